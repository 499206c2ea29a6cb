//! What a shell gets from the program: completions and manual pages.

use crate::common::run;

#[test]
fn every_shell_gets_completions_of_every_command() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = run(&["completions", shell]);
        assert_eq!(script.code, Some(0), "{}", script.stderr);
        for word in ["generate", "report", "convert", "overwrite"] {
            assert!(script.stdout.contains(word), "{shell} lacks {word}");
        }
    }
    let wrong = run(&["completions", "cmd"]);
    assert_eq!(wrong.code, Some(2));
    assert!(
        wrong.stderr.contains("possible values: bash"),
        "{}",
        wrong.stderr
    );
}

#[test]
fn each_command_has_a_manual_page() {
    let program = run(&["man"]);
    assert_eq!(program.code, Some(0), "{}", program.stderr);
    assert!(
        program.stdout.contains(".TH nemoral 1"),
        "{}",
        program.stdout
    );
    let command = run(&["man", "generate"]);
    assert_eq!(command.code, Some(0), "{}", command.stderr);
    assert!(
        command.stdout.contains("\\-\\-overwrite"),
        "{}",
        command.stdout
    );
    let wrong = run(&["man", "grow"]);
    assert_eq!(wrong.code, Some(2));
    assert!(
        wrong.stderr.contains("no command 'grow'"),
        "{}",
        wrong.stderr
    );
    assert!(wrong.stderr.contains("merge"), "{}", wrong.stderr);
}
