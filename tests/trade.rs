//! `trade` from the outside: wrong usage, messages, and the files that it writes.

use std::process::{Command, Output, Stdio};

fn trade(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_crystal-ball"))
        .arg("trade")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program can be started")
}

/// Checks that a debug build refuses, because its times would include its checks.
#[cfg(debug_assertions)]
#[test]
fn a_debug_build_refuses_and_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = trade(&["--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(
        errors.contains("`cargo run --release -- trade`"),
        "{errors}"
    );
    assert!(output.stdout.is_empty() && !out.exists());
}

/// With `cargo test --release`: one scene, two mappers, and only complete files.
#[cfg(not(debug_assertions))]
#[test]
fn a_release_build_measures_the_requested_scenes_and_mappers() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = trade(&[
        "--quick",
        "--scene",
        "wall",
        "--mappers",
        "affine,exact",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(0));
    let path = String::from_utf8(output.stdout).unwrap();
    assert_eq!(path.trim(), out.join("trade.html").to_str().unwrap());
    let csv = std::fs::read_to_string(out.join("trade.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2);
    assert!(csv.lines().skip(1).all(|line| line.starts_with("wall,")));
    let files = std::fs::read_dir(&out).unwrap();
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    assert!(names.into_iter().all(|name| !name.starts_with('.')));
}

#[test]
fn an_unknown_scene_or_mapper_is_wrong_usage_and_the_error_lists_the_known_names() {
    for (option, known) in [("--scenes", "grazing-4096"), ("--mappers", "two-carries")] {
        let output = trade(&[option, "no-such"]);
        assert_eq!(output.status.code(), Some(2), "{option}");
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(errors.contains(known), "{errors}");
    }
}
