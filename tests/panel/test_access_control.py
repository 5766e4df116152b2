"""Who may use the page: host, origin and token of every request, and what an answer may load."""

from __future__ import annotations

import http.client
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest

from dcmp_hil import panel
from tests.live.processes import TIMEOUT_S, own_folder, started
from tests.panel.test_browser import address_of, free_port

if TYPE_CHECKING:
    from collections.abc import Iterator


class _Page(NamedTuple):
    port: int
    token: str

    def ask(
        self, method: str, path: str, body: str | None = None, **headers: str
    ) -> tuple[int, str, http.client.HTTPMessage]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=TIMEOUT_S)
        try:
            given = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, body, given)
            answer = connection.getresponse()
            return answer.status, answer.read().decode(), answer.headers
        finally:
            connection.close()

    @property
    def cookie(self) -> str:
        return f"dcmp_hil_{self.port}={self.token}"

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[_Page]:
    port = free_port()
    with pytest.MonkeyPatch.context() as patch, own_folder(patch):
        arguments = ("panel", "--port", str(port), "--viewer", 'http://127.0.0.1:9090/x?a="b')
        with started(tmp_path_factory.mktemp("panel"), *arguments) as process:
            yield _Page(port, address_of(process).partition("token=")[2])


def test_token_is_exchanged_for_a_cookie_that_no_other_site_is_sent(page: _Page) -> None:
    status, _, headers = page.ask("GET", f"/?token={page.token}")
    assert (status, headers["Location"]) == (303, "/")
    assert headers["Set-Cookie"] == f"{page.cookie}; HttpOnly; Path=/; SameSite=Strict"
    status, text, headers = page.ask("GET", "/", Cookie=page.cookie)
    assert status == 200
    assert "<title>dcmp-hil</title>" in text
    assert 'data-viewer="http://127.0.0.1:9090/x?a=&quot;b"' in text
    assert "default-src 'none'; script-src 'self'" in headers["Content-Security-Policy"]
    assert "frame-src http://127.0.0.1:9090;" in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    "path",
    ["/", "/events", "/panel.js", "/uplot.js", "/panel.css", "/nothing", "/?token=wrong", "/?token=%ff"],
)
def test_no_request_gets_in_without_the_token(page: _Page, path: str) -> None:
    for cookie in ("", "other=1", f"dcmp_hil_{page.port}=wrong"):
        status, text, headers = page.ask("GET", path, Cookie=cookie)
        assert status == 403
        assert "token" in text
        assert "default-src 'none'" in headers["Content-Security-Policy"]


@pytest.mark.parametrize("path", ["/set", "/stop", "/rig-diff", "/rig-write"])
def test_another_page_can_neither_change_nor_stop_nor_write(page: _Page, path: str) -> None:
    for origin in ({}, {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Origin": "http://127.0.0.1"}):
        status, _, _ = page.ask("POST", path, '{"changes": []}', Cookie=page.cookie, **origin)
        assert status == 403, origin
    body = '{"changes": [], "proposal": "x"}'
    status, text, _ = page.ask("POST", path, body, Cookie=page.cookie, Origin=page.origin)
    expected = {"/rig-diff": "no run whose rig", "/rig-write": "no longer known"}
    assert (status, expected.get(path, "There is no run.") in text) == (200, True)


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "evil.example:80", "127.0.0.1:1"])
def test_another_name_for_this_machine_is_refused(page: _Page, host: str) -> None:
    status, text, _ = page.ask("GET", "/", Cookie=page.cookie, Host=host)
    assert (status, text) == (403, "Another host than this machine.")


@pytest.mark.parametrize("body", ["", "nonsense", "[]", '{"changes": "a=1"}', '{"changes": [1]}', "{}"])
def test_what_is_no_change_is_refused(page: _Page, body: str) -> None:
    status, text, _ = page.ask("POST", "/set", body, Cookie=page.cookie, Origin=page.origin)
    assert (status, "KEY=VALUE" in text) == (400, True)


@pytest.mark.parametrize("body", ["", "[]", '{"proposal": 1}', "{}"])
def test_what_accepts_no_diff_is_refused(page: _Page, body: str) -> None:
    status, _, _ = page.ask("POST", "/rig-write", body, Cookie=page.cookie, Origin=page.origin)
    assert status == 400


def test_every_file_of_the_page_is_served(page: _Page) -> None:
    folder = Path(panel.__file__).parent / "page"
    for file in folder.iterdir():
        path = "/" if file.name == "index.html" else f"/{file.name}"
        status, text, headers = page.ask("GET", path, Cookie=page.cookie)
        assert (status, len(text) > 100) == (200, True), file.name
        assert headers["Content-Type"].startswith(("text/javascript", "text/css", "text/html"))
    for path in ("/uplot.js", "/uplot.css"):
        assert page.ask("GET", path, Cookie=page.cookie)[0] == 200


def test_port_in_use_is_said(page: _Page, tmp_path_factory: pytest.TempPathFactory) -> None:
    with started(tmp_path_factory.mktemp("second"), "panel", "--port", str(page.port)) as second:
        _, err = second.communicate(timeout=TIMEOUT_S)
    assert second.returncode == 2
    assert err.startswith(f"error: --port {page.port}: ")
    assert len(err.splitlines()) == 1


def test_viewer_that_is_no_address_is_refused(tmp_path_factory: pytest.TempPathFactory) -> None:
    with started(tmp_path_factory.mktemp("third"), "panel", "--viewer", "javascript:alert(1)") as third:
        _, err = third.communicate(timeout=TIMEOUT_S)
    assert third.returncode == 2
    assert "expected a URL" in err
