//! `trade` from the outside: what it refuses, its messages, and the files that it leaves.

use std::process::{Command, Output, Stdio};

fn trade(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_crystal-ball"))
        .arg("trade")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program can be started")
}

/// A debug build would measure its own checks.
#[cfg(debug_assertions)]
#[test]
fn a_debug_build_refuses_and_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let said = trade(&["--out", out.to_str().unwrap()]);
    assert_eq!(said.status.code(), Some(2));
    let words = String::from_utf8(said.stderr).unwrap();
    assert!(words.contains("`cargo run --release -- trade`"), "{words}");
    assert!(said.stdout.is_empty() && !out.exists());
}

/// With `cargo test --release`: one scene, two mappers, and only complete files.
#[cfg(not(debug_assertions))]
#[test]
fn a_release_build_measures_what_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let said = trade(&[
        "--quick",
        "--scene",
        "wall",
        "--mappers",
        "affine,exact",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(said.status.code(), Some(0));
    let path = String::from_utf8(said.stdout).unwrap();
    assert_eq!(path.trim(), out.join("trade.html").to_str().unwrap());
    let csv = std::fs::read_to_string(out.join("trade.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2);
    assert!(csv.lines().skip(1).all(|line| line.starts_with("wall,")));
    let files = std::fs::read_dir(&out).unwrap();
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    assert!(names.into_iter().all(|name| !name.starts_with('.')));
}

#[test]
fn an_unknown_scene_or_mapper_is_wrong_usage_and_the_known_are_listed() {
    for (option, known) in [("--scenes", "grazing-4096"), ("--mappers", "two-carries")] {
        let said = trade(&[option, "no-such"]);
        assert_eq!(said.status.code(), Some(2), "{option}");
        let words = String::from_utf8(said.stderr).unwrap();
        assert!(words.contains(known), "{words}");
    }
}
