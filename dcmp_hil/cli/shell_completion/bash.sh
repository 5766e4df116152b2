_dcmp_hil() {
    local line=${COMP_LINE:0:COMP_POINT} typed current option command files='' breaks='' head=''
    local -a before reply found names
    read -ra before <<< "$line" # bash itself parts words at = and :, too
    if [[ $line == *[[:space:]] ]]; then before+=(''); fi
    typed=${before[${#before[@]} - 1]}
    current=$typed
    _dcmp_hil_place "${before[@]:1:${#before[@]} - 2}"
    if [[ -z $option && $current == --*=* ]]; then
        option=${current%%=*} head=${current%%=*}=
        current=${current#*=}
    fi
    _dcmp_hil_find "$current" "$option"
    COMPREPLY=("${found[@]}")
    if [[ -n $files ]]; then
        mapfile -t names < <(compgen -f -X "!$files" -- "$current"; [[ $files == '*' ]] || compgen -d -- "$current")
        COMPREPLY+=("${names[@]}")
        compopt -o filenames 2> /dev/null
    fi
    COMPREPLY=("${COMPREPLY[@]/#/$head}")
    if [[ $option == --fault || $option == --compare || ( ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *= ) ]]; then
        compopt -o nospace 2> /dev/null # more may follow: the value of a key, the keys of a fault
    fi
    if [[ $COMP_WORDBREAKS == *=* ]]; then breaks+='='; fi
    if [[ $COMP_WORDBREAKS == *:* ]]; then breaks+=':'; fi
    if [[ -n $breaks && $typed == *[$breaks]* ]]; then # bash replaces what stands behind the last of them
        head=${typed%"${typed##*[$breaks]}"}
        COMPREPLY=("${COMPREPLY[@]#"$head"}")
    fi
}

complete -F _dcmp_hil dcmp-hil
