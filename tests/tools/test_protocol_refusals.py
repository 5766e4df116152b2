"""What the generators would get wrong is refused, with the place and a remedy: our DBC with one edit each."""

from __future__ import annotations

import importlib
import re
import sys
from typing import TYPE_CHECKING

import pytest

from tools.protocol import __main__ as protocol
from tools.protocol import c_code, python_code
from tools.protocol.dbc import DBC, attribute, load
from tools.protocol.layout import layouts
from tools.protocol.statements import DbcError

if TYPE_CHECKING:
    from pathlib import Path

TEXT = DBC.read_text("utf-8")
END = 'BA_ "NoEnum" SG_ 64 fault_class 1;\n'
VALUES = re.findall(r"(?m)^VAL_ \d+ id (.*;)$", TEXT)
DETAIL = " SG_ detail : 16|32@1- (1,0) [-2147483648|2147483647]"
RULE = "it is 16 times the message's number, which is 1 to 127"

STATEMENTS = [
    # Identifiers
    ("BO_ 80 EDGE", "BO_ 81 EDGE", f"EDGE: its identifier 81 is not of node 0; {RULE}; 80 is free$"),
    ("BO_ 16 STOP", "BO_ 0 STOP", f"STOP: its identifier 0 is not of node 0; {RULE}; 16 is free$"),
    ("BO_ 176 HEALTH", "BO_ 2048 HEALTH", "HEALTH: its identifier 2048 is not of node 0; .*; 176 is free"),
    ("BO_ 80 EDGE", "BO_ 64 EDGE", "SAMPLE and EDGE: both have the identifier 64; .*; 80 is free"),
    ("BO_ 80 EDGE", "BO_ 2147483728 EDGE", "EDGE: its identifier 2147483728 is extended, and has 11 bits"),
    # Names, and what is said of them
    ("EDGE: 8", "SAMPLE: 8", "line .*: 'BO_ 80 SAMPLE: 8 DEVICE' says again what line .* says; rename or"),
    ("SG_ age_us", "SG_ age_µs", "line .*: age_µs has other letters than a to z and A to Z; rename it$"),
    ("EDGE: 8", "ÉDGE: 8", "line .*: ÉDGE: has other letters than a to z and A to Z; rename it$"),
    ("SG_ age_us", "SG_ tick", "line .*: 'SG_ tick .*' says again what line .* says; rename or remove one"),
    ("VAL_ 144 id", "VAL_ 128 id", "line .*: 'VAL_ 128 id .*' says again what line .* says"),
    ("VAL_ 144 id", "VAL_ 145 id", "line .*: 'VAL_ 145 id .*' is about what is not there; correct its"),
    ("CM_ SG_ 80 age_us", "CM_ SG_ 80 age", "line .*: 'CM_ SG_ 80 age .*' is about what is not there"),
    ("CM_ BO_ 176", "CM_ BO_ 177", "line .*: 'CM_ BO_ 177 .*' is about what is not there"),
    ('"PlacedBefore" SG_ 32 seq', '"PlacedBefore" SG_ 48 seq', "line .*: .* is about what is not there"),
    # Attributes
    ('BA_DEF_ SG_ "CEnum"', 'BA_DEF_ SG_ "CEnums"', r"line .* is not understood; these are: PythonClass"),
    ('BA_DEF_ BO_ "CStruct" STRING ;', 'BA_DEF_ BO_ "VFrameFormat" INT 0 1;', "line .* is not understood;"),
    ('"CStruct" BO_ 80', '"CStruct" SG_ 80 tick', "line .* is an attribute that is not understood; these"),
    ('BA_DEF_DEF_ "CEnum" ""', 'BA_DEF_DEF_ "CEnum" "all"', "line .*: 'BA_DEF_DEF_ .* write it in one line,"),
    # Statements
    (END, END + "SIG_VALTYPE_ 48 detail : 1;\n", "line .*: SIG_VALTYPE_ is not understood; the wire has"),
    (END, END + 'VAL_TABLE_ Parameter 1 "BOARD" ;\n', "line .*: VAL_TABLE_ is not understood; no field can"),
    (END, END + "BO_TX_BU_ 48 : HOST,DEVICE;\n", "line .*: BO_TX_BU_ is not understood; a message has one"),
    (END, END + "SG_MUL_VAL_ 48 detail code 1-2;\n", "line .*: SG_MUL_VAL_ is not understood; a message has"),
    (END, END + "SIG_GROUP_ 48 both 1 : code tick;\n", "line .*: 'SIG_GROUP_ .*' is not understood; a"),
    ("SG_ code :", "SG_ code M :", "line .*: code is multiplexed; a message has one layout: give each"),
    ("SG_ detail :", "SG_ detail m1 :", "line .*: detail is multiplexed; a message has one layout"),
    ("BU_: HOST DEVICE", "BU_: HOST DEVICE PANEL", "line .* is not understood; write it in one line, as in"),
    # What the hash would not cover, as it does not begin a line, or goes on in the next
    ('3 "PERSON"', '\n3 "PERSON"', "line .*: 'VAL_ 16 reason .*' is not understood; write it in one line"),
    ("\n SG_ detail", " SG_ detail", "line .*: 'SG_ tick .*' is not understood; write it in one line"),
    ("VAL_ 64 state", "VAL_  64 state", "line .* is not understood; write it in one line"),
    (" SG_ detail", "\tSG_\tdetail", "line .* is not understood; write it in one line"),
    ('"The answer to HELLO."', '"The answer\nto HELLO."', "line .* is not understood; write it in one line"),
    # Texts that would end a comment of C, or a cell of the page
    ("Reason for a STOP.", "Reason */ STOP.", "line .* would begin or end a comment of C; leave the "),
    ("Ask for a parameter.", "Ask | wait.", r"line .* would end a cell of the page's table; leave the \|"),
    # Named values
    ('3 "PERSON"', '2 "PERSON"', "line .*: VAL_ of reason has 2 twice; remove or renumber one"),
    ('3 "PERSON"', '3 "REQUESTED"', 'line .*: VAL_ of reason has "REQUESTED" twice; remove or renumber one'),
]
RULES = [
    # Messages
    ("STOP: 2", "STOP: 9", "STOP has 9 bytes; it may have 2 to 8, with its crc8: correct the length, or"),
    ("STOP: 2", "STOP: 1", "STOP has 1 bytes; it may have 2 to 8"),
    ("BO_ 16 STOP: 2 HOST", "BO_ 16 STOP: 2 Vector__XXX", "STOP: its sender is HOST or DEVICE, not none"),
    ("BO_ 16 STOP: 2 HOST", "BO_ 16 STOP: 2 PANEL", "STOP: its sender is HOST or DEVICE, not PANEL"),
    ("BO_ 16 STOP: 2 HOST", "BO_ 16 STOP: 2 DEVICE", r"STOP\.reason: DEVICE sends it, so that its receiver"),
    ('CM_ BO_ 112 "The answer to HELLO.";\n', "", r"IDENTITY has no comment; say when it is sent: CM_ BO_"),
    ("STOP: 2", "Stop: 2", "Stop: a message's name has capitals, digits and single _"),
    ("EDGE: 8", "DRIVE_: 8", "DRIVE_: a message's name has capitals"),
    ("EDGE: 8", "SHARP__EDGE: 8", "SHARP__EDGE: a message's name has capitals"),
    (
        '"SampleReport"',
        '"sample-report"',
        "SAMPLE: its PythonClass is 'sample-report'; write it as in SampleRep",
    ),
    ('"dcmp_edge_stamp"', '"edge"', "EDGE: its CStruct is 'edge'; write it as in dcmp_edge_stamp"),
    # Places
    ("8|32@1-", "8|32@0-", r"PARAMETER_VALUE\.value is not little-endian; write @1, and its lowest bit"),
    ("SG_ ttl_ms : 48|8", "SG_ ttl_ms : 47|8", r"DRIVE: session and ttl_ms overlap; ttl_ms can begin at bit"),
    ("SG_ arm : 16", "SG_ arm : 17", "DRIVE: .* overlap; .* can begin at bit 18"),
    ("SG_ seq : 19|13", "SG_ seq : 19|14", "DRIVE: seq and session overlap; session can begin at bit 33"),
    ("IDENTITY: 8", "IDENTITY: 6", r"IDENTITY\.busy ends behind the message's 6 bytes; lengthen the message"),
    ("HEALTH: 7", "HEALTH: 8", r"HEALTH: its last byte is not its crc8; write SG_ crc8 : 56\|8@1\+"),
    ('SG_ crc8 : 56|8@1+ (1,0) [0|255] "" HOST\n\nBO_ 80', "\nBO_ 80", "SAMPLE: its last byte is not its"),
    # Fields
    ("SG_ idle_percent :", "SG_ Idle :", r"HEALTH\.Idle: a field's name begins with a small letter"),
    ("SG_ detail :", "SG_ default :", r"FAULT\.default: default is a word of C, of Python or .*; rename it"),
    ("SG_ detail :", "SG_ lambda :", r"FAULT\.lambda: lambda is a word of C, of Python or .*; rename it"),
    ("SG_ detail :", "SG_ make :", r"FAULT\.make: make is a word of .* the generated code; rename it"),
    ("SG_ late_ticks :", "SG_ late_ticks_ :", r"HEALTH\.late_ticks_: a field's name .* does not end in _"),
    (DETAIL, DETAIL.replace("(1,0)", "(0.1,0)"), r"FAULT\.detail has a scale or an offset; write \(1,0\): "),
    (DETAIL, DETAIL.replace("(1,0)", "(1,5)"), r"FAULT\.detail has a scale or an offset; write \(1,0\): "),
    (DETAIL, " SG_ detail : 16|24@1- (1,0) [0|1]", "FAULT: detail: a field of whole bytes has 8, 16 or 32"),
    (DETAIL, " SG_ detail : 16|12@1- (1,0) [0|1]", "FAULT: detail: a signed field shares no byte; give it"),
    (DETAIL, " SG_ detail : 20|20@1+ (1,0) [0|1]", "FAULT: detail: fields share 1, 2 or 4 bytes, not 3;"),
    ("[5|50]", "[0|0]", r"DRIVE\.ttl_ms has no bounds; write \[0\|255\], or what it may be of that"),
    ("[5|50]", "[5|50.5]", r"DRIVE\.ttl_ms has bounds that are no integers, and would be cut"),
    ("[5|50]", "[5|256]", r"DRIVE\.ttl_ms: its bounds are not within 0\.\.255"),
    ("[5|50]", "[50|5]", r"DRIVE\.ttl_ms: its bounds are not within 0\.\.255"),
    ("[-1|1]", "[-129|1]", r"EDGE\.direction: its bounds are not within -128\.\.127"),
    ('"%"', '"a|b"', r"HEALTH\.idle_percent: its unit 'a\|b' has other signs than"),
    # Named values and enumerations
    ('4 "FAULT";', '8 "FAULT";', r"SAMPLE\.state: VAL_ 8 FAULT is outside its bounds; renumber it, or widen"),
    ('4 "FAULT";', '4 "Fault";', r"SAMPLE\.state: VAL_ 4 Fault: a value's name has capitals"),
    (END, END + 'VAL_ 64 missed 0 "NO" 1 "YES";\n', r"SAMPLE\.missed is one bit, a bool without names;"),
    (END, "", r"SAMPLE\.fault_class: its VAL_ rows are those of no enumeration; name its own with"),
    (END, END + 'BA_ "NoEnum" SG_ 64 tick 1;\n', r"SAMPLE\.tick has NoEnum, and no VAL_ rows; remove it"),
    (END, END + 'BA_ "NoEnum" SG_ 64 state 1;\n', r"SAMPLE\.state names an enumeration, and has NoEnum;"),
    (END, END + 'BA_ "CEnum" SG_ 32 seq "dcmp_seq";\n', r"DRIVE\.seq names an enumeration, and has no"),
    ('CM_ SG_ 16 reason "Reason for a STOP.";\n', "", r"STOP\.reason names an enumeration, and has no"),
    ('"StopReason"', '"Stop-Reason"', r"STOP\.reason: name its enumeration as in StopReason \(Python\)"),
    ('"StopReason"', '"StopÄnderung"', r"STOP\.reason: name its enumeration as in StopReason \(Python\)"),
    ('"SampleReport"', '"SampleReportÄ"', "SAMPLE: its PythonClass is 'SampleReportÄ'; write it as in"),
    ('"ParameterResult"', '"Parameter"', r"PARAMETER_GET\.id and PARAMETER_VALUE\.result both name the"),
    (f"VAL_ 144 id {VALUES[1]}\n", "", r"PARAMETER_GET\.id and PARAMETER_SET\.id have different VAL_ rows"),
    # Names of the generated code
    ('5 "NOT_OWNER"', '5 "DRIVE"', "two constants of C have one name: DCMP_DRIVE; rename one"),
    ('5 "NOT_OWNER"', '5 "LAYOUTS"', "two constants of C have one name: DCMP_LAYOUTS; rename one"),
    ('"SampleReport"', '"Drive"', "two classes of Python have one name: Drive; rename one"),
    ('"StopReason"', '"Stop"', "two classes of Python have one name: Stop; rename one"),
    ('"FaultReport"', '"Message"', "two classes of Python have one name: Message; rename one"),
    ('"dcmp_edge_stamp"', '"dcmp_state"', "two structures or enumerations of C have one name: dcmp_state;"),
    ('SG_ 32 seq "arm"', 'SG_ 32 seq "seq"', r"DRIVE\.seq: PlacedBefore is another field of it, not seq"),
    ('SG_ 32 seq "arm"', 'SG_ 32 seq "tick"', r"DRIVE\.seq: PlacedBefore is another field of it, not tick"),
]


def _edited(old: str, new: str) -> str:
    assert TEXT.count(old) == 1
    return TEXT.replace(old, new)


def test_the_dbc_itself_is_taken() -> None:
    c_code.header(layouts(load(TEXT)))


@pytest.mark.parametrize(("old", "new", "said"), STATEMENTS)
def test_a_statement_that_is_not_understood_is_refused(old: str, new: str, said: str) -> None:
    with pytest.raises(DbcError, match=f"^{said}"):
        load(_edited(old, new))


@pytest.mark.parametrize(("old", "new", "said"), RULES)
def test_what_breaks_a_rule_is_refused(old: str, new: str, said: str) -> None:
    database = load(_edited(old, new))  # whose text is understood
    with pytest.raises(DbcError, match=f"^{said}"):
        c_code.header(layouts(database))


def test_a_field_is_not_named_as_a_half_of_another() -> None:
    database = load(TEXT.replace("age_us", "position_counts_low"))
    with pytest.raises(
        DbcError, match=r"^EDGE: position_counts_low is a half of position_counts; rename it$"
    ):
        layouts(database)


@pytest.mark.parametrize("other", [1, 2], ids=["PARAMETER_SET", "PARAMETER_VALUE"])
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('16 "TRAVEL_ORIGIN_COUNTS"', '16 "TRAVEL_ORIGIN"', "16 TRAVEL_ORIGIN, 16 TRAVEL_ORIGIN_COUNTS"),
        ('3 "RESET_CAUSE"', '17 "RESET_CAUSE"', "3 RESET_CAUSE, 17 RESET_CAUSE"),
        (";", ' 17 "NEW";', "17 NEW"),
    ],
)
def test_a_parameter_that_is_written_at_one_field_only_is_refused(
    other: int, old: str, new: str, said: str
) -> None:
    where = ["PARAMETER_GET", "PARAMETER_SET", "PARAMETER_VALUE"][other]
    number = [128, 144, 160][other]
    row = f"VAL_ {number} id {VALUES[other]}"
    database = load(_edited(row, row.replace(old, new)))
    with pytest.raises(DbcError) as refused:
        layouts(database)
    assert str(refused.value) == (
        f"PARAMETER_GET.id and {where}.id have different VAL_ rows ({said}); "
        "make them equal, or rename a field"
    )


def test_a_parameter_that_is_written_at_all_fields_is_taken() -> None:
    text = TEXT.replace('16 "TRAVEL_ORIGIN_COUNTS";', '16 "TRAVEL_ORIGIN_COUNTS" 17 "NEW";')
    assert "    NEW = 17\n" in python_code.messages(layouts(load(text)))


def test_two_enumerations_with_equal_rows_keep_their_names() -> None:
    rows = 'BOOT" 1 "IDLE" 2 "ARMING" 3 "RUN" 4 "FAULT";'
    assert rows in TEXT
    text = f'{TEXT}BA_ "PythonEnum" SG_ 80 age_us "Phase";\nVAL_ 80 age_us 0 "{rows}\n'
    said = python_code.messages(layouts(load(text)))
    assert "    state: int  # a State\n" in said
    assert "    age_us: int  # a Phase. " in said or "    age_us: int  # a Phase\n" in said
    with pytest.raises(
        DbcError, match=r"^HEALTH\.late_ticks: its VAL_ rows are those of 2 enumerations; name its"
    ):
        layouts(load(f'{text}VAL_ 176 late_ticks 0 "{rows}\n'))


def test_enumerations_of_python_that_are_not_generated_have_the_rows_of_the_dbc() -> None:
    """A rig's own faults may be more than those of the wire."""
    named = {
        (name, signal)
        for message in load(TEXT).messages
        for signal in message.signals
        if "." in (name := attribute(signal, "PythonEnum"))
    }
    assert named
    for name, signal in named:
        module, _, kind = name.rpartition(".")
        members = getattr(importlib.import_module(module), kind)
        assert signal.choices
        assert {str(each): members[str(each)].value for each in signal.choices.values()} == {
            str(each): number for number, each in signal.choices.items()
        }


def test_a_gap_in_the_numbers_is_taken() -> None:
    lines = [line for line in re.sub(r"(?s)BO_ 80 EDGE.*?\n\n", "", TEXT).splitlines() if " 80 " not in line]
    found = layouts(load("\n".join(lines)))
    assert "EDGE" not in {one.name for one in found}
    assert len(found) == TEXT.count("\nBO_ ") - 1
    header = c_code.header(found)
    assert header.count("{0, false},  /* no message */") == 2
    assert "    5: MessageLayout" not in python_code.layouts(found)


def test_the_filter_of_can_has_what_the_host_sends() -> None:
    header = c_code.header(layouts(load(TEXT)))
    listed = re.search(r"#define DCMP_FROM_HOST \{([^}]*)\}", header)
    assert listed
    sent = [f"DCMP_{name}" for name in re.findall(r"(?m)^BO_ \d+ (\w+): \d HOST$", TEXT)]
    assert re.findall(r"\w+", listed[1]) == sent
    assert len(sent) == 5


def test_the_tool_says_what_it_refuses(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    dbc = tmp_path / "dcmp.dbc"
    dbc.write_text(_edited("BO_ 80 EDGE", "BO_ 81 EDGE"), "utf-8")
    monkeypatch.setattr(protocol, "DBC", dbc)
    monkeypatch.setattr(sys, "argv", ["protocol"])
    with pytest.raises(SystemExit, match=r"^dcmp\.dbc: EDGE: its identifier 81 is not of node 0; "):
        protocol.main()
