_dcmp_hil() {
    local current=$words[CURRENT] option command files=''
    local -a reply found
    _dcmp_hil_place "${(@)words[2,CURRENT-1]}"
    if [[ -z $option && $current == --*=* ]]; then
        option=${current%%=*}
        current=${current#*=}
        compset -P 1 '*='
    fi
    _dcmp_hil_find "$current" "$option"
    if [[ $option == --fault || $option == --compare ]]; then # its keys may follow, or the next of a list
        compadd -S '' -- "${(@)found}"
    else
        compadd -S '' -- "${(@M)found:#*=}"
        compadd -- "${(@)found:#*=}"
    fi
    if [[ -n $files ]]; then _files -g "$files"; fi
}

if [[ $funcstack[1] == _dcmp-hil ]]; then # a file of $fpath
    _dcmp_hil "$@"
else
    compdef _dcmp_hil dcmp-hil
fi
