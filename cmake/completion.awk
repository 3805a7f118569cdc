# SPDX-License-Identifier: Apache-2.0
# Shell completion of commands, options, and values out of a set. Reads, for the program and then for each of its commands,
# a line "command NAME" and the --help. Writes the files that `bash` and `fish` name.

function quoted(text) { gsub(/'/, "\\'", text); return "'" text "'" }

# One option, whose lines end here.
function finish(    begin, i) {
    if (!names) return
    begin = "complete -c " name (command ? " -n '__fish_seen_subcommand_from " command "'" : "")
    for (i = 1; i <= names; i++) {
        words[command] = words[command] " " option[i]
        if (values != "") cases = cases "        " command_pattern() "' " option[i] "') words='" values "' ;;\n"
        begin = begin (option[i] ~ /^--/ ? " -l " substr(option[i], 3) : " -s " substr(option[i], 2))
    }
    begin = begin (values != "" ? " -x -a " quoted(values) : takes_value ? " -r" : "")
    if (command != "" || !has_commands) fish_options = fish_options begin " -d " quoted(about) "\n"
    names = 0
}
function command_pattern() { return command == "" ? "*" : command }

/^command / { finish(); command = $2; listed = 0; next }
/^Subcommands:/ { finish(); listed = has_commands = 1; next }
/^[^ ]|^$/ { finish(); next }
listed && /^  [a-z]/ {
    about = $0
    sub(/^ +[^ ]+ +/, "", about)
    commands = commands $1 " "
    last = $1
    command_about[last] = about
    next
}
listed { sub(/^ +/, ""); command_about[last] = command_about[last] " " $0; next }
/^  -/ {
    finish()
    about = ""
    line = substr($0, 3)
    if (match(line, /  +/)) { about = substr(line, RSTART + RLENGTH); line = substr(line, 1, RSTART - 1) }
    count = split(line, part, " ")
    names = 1
    while (part[names] ~ /,$/) names++
    for (i = 1; i <= names; i++) { option[i] = part[i]; sub(/,$/, "", option[i]) }
    takes_value = count > names
    values = takes_value && part[names + 1] ~ /^[a-z0-9-]+(\|[a-z0-9-]+)+$/ ? part[names + 1] : ""
    gsub(/\|/, " ", values)
    next
}
names && /^ / { sub(/^ +/, ""); about = about (about == "" ? "" : " ") $0 }

END {
    finish()
    shell_function = "_" name
    gsub(/-/, "_", shell_function)
    print "# Completion of " name " for bash; zsh reads it after `autoload -U bashcompinit && bashcompinit`." > bash
    print shell_function "() {\n    local word=${COMP_WORDS[COMP_CWORD]} words=" > bash
    if (has_commands) {
        print "    if ((COMP_CWORD == 1)); then" > bash
        print "        COMPREPLY=($(compgen -W '" commands "--help --version' -- \"$word\"))" > bash
        print "        return\n    fi" > bash
    }
    print "    case \"${COMP_WORDS[1]} ${COMP_WORDS[COMP_CWORD-1]}\" in\n" cases "    esac" > bash
    print "    if [[ -z $words && $word == -* ]]; then\n        case ${COMP_WORDS[1]} in" > bash
    count = split(has_commands ? commands : "*", part, " ")
    for (i = 1; i <= count; i++)
        print "            " part[i] ") words='" substr(words[has_commands ? part[i] : ""], 2) "' ;;" > bash
    print "        esac\n    fi\n    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n}" > bash
    print "complete -o default -F " shell_function " " name > bash

    print "# Completion of " name " for fish." > fish
    count = split(commands, part, " ")
    for (i = 1; i <= count; i++)
        print "complete -c " name " -n __fish_use_subcommand -a " part[i] " -d " quoted(command_about[part[i]]) > fish
    printf "%s", fish_options > fish
}
