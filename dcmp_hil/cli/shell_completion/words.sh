# For bash and zsh. Words that may follow are left in `reply`, a pattern of file names in `files`.

_dcmp_hil_words() {
    case $1 in
@WORDS@
    esac
}

# What may follow an option of a command, or the command itself if there is none. It fails for a flag.
_dcmp_hil_follows() {
    reply=() files=''
    case "$1 $2" in
@FOLLOWS@
    (*) return 1 ;;
    esac
}

_dcmp_hil_options() {
    case $1 in
@OPTIONS@
    (*) reply=(--version --help -h) ;;
    esac
}

# Finds the command, and the option whose value comes next, among the words before the current one.
_dcmp_hil_place() {
    local word
    command='' option=''
    for word in "$@"; do
        if [[ -n $option ]]; then
            option=''
        elif [[ $word == -* ]]; then
            if [[ $word != *=* ]] && _dcmp_hil_follows "$command" "$word"; then option=$word; fi
        elif [[ -z $command ]]; then
            command=$word
        fi
    done
}

# Leaves in `found` what the current word `$1` can become; `$2` is the option, if its value is written behind `=`.
_dcmp_hil_find() {
    local word rest current=$1 head='' list=''
    found=()
    if [[ -n $2 ]]; then
        _dcmp_hil_follows "$command" "$2"
    elif [[ $current == -* ]]; then
        _dcmp_hil_options "$command"
    elif [[ -z $command ]]; then
        reply=(@COMMANDS@)
    else
        _dcmp_hil_follows "$command" ''
    fi
    if [[ $current == *:*,* ]]; then # a fault: its later keys are those of its kind
        head=${current%,*},
        current=${current%%:*}:${current##*,}
    elif [[ $current == *,* && $current != *[=:]* ]]; then # a list of observers
        list=${current%,*},
        current=${current##*,}
    fi
    for word in "${reply[@]}"; do
        rest=${word#"$current"}
        if [[ $word != "$current"* || $rest == *[=:]?* || ( -z $rest && $word == *= ) ]]; then continue; fi
        if [[ -n $list && $word == *= ]]; then continue; fi
        if [[ -n $head ]]; then word=$head${word#*:}; fi
        word=$list$word
        found+=("$word")
    done
}
