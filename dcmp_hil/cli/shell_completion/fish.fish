function __dcmp_hil_words
    switch $argv[1]
@WORDS@
    end
end

# The words that the current one can become; the value of a key comes after the key.
function __dcmp_hil_find
    set -l current (commandline -ct | string replace -r '^--[a-z-]+=' '')
    if string match -q -- '*:*,*' $current
        set -l kind (string replace -r ':.*' ':' -- $current)
        set -l head (string replace -r '[^,]*$' '' -- $current)
        for word in (__dcmp_hil_words $argv[1])
            if string match -q -- "$kind*" $word
                echo $head(string replace -- $kind '' $word)
            end
        end
    else if string match -q -- '*,*' $current; and not string match -qr -- '[=:]' $current
        set -l head (string replace -r '[^,]*$' '' -- $current)
        for word in (__dcmp_hil_words $argv[1] | string match -v -- '*=*')
            echo $head$word
        end
    else if string match -q -- '*=*' $current; or string match -q -- '*:*' $current
        __dcmp_hil_words $argv[1]
    else
        __dcmp_hil_words $argv[1] | string replace -r '=.*' '=' | string replace -r ':.*' ''
    end
end

complete -c dcmp-hil -f
complete -c dcmp-hil -n __fish_use_subcommand -l version -d 'Print the version'
complete -c dcmp-hil -s h -l help -d 'Show the help'
