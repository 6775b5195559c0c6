//! `record` and `replay` from the outside: real QEMU, and the resulting files.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::LazyLock;

use frames::difference::Capture;
use frames::indexed::IndexedImage;
use vga::widen;

use crate::ready::READY;

/// Runs the program; returns its exit code, standard output and standard error.
fn crystal_ball(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    LazyLock::force(&READY);
    let mut program = Command::new(env!("CARGO_BIN_EXE_crystal-ball"));
    program
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null());
    let output = program.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// Returns the only image of a PNG.
fn frame(path: &Path) -> IndexedImage {
    match Capture::read(path).unwrap() {
        Capture::Png(frame) => frame,
        Capture::Dump(_) => panic!("{} is not a PNG", path.display()),
    }
}

#[test]
fn a_recording_has_the_emulated_vgas_frames_and_the_same_bytes_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let record = |out: &str| {
        let line = format!("record --scene knot --frames 90..=95 --every 5 --out {out}");
        let arguments: Vec<_> = line.split(' ').collect();
        let (code, output, errors) = crystal_ball(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{errors}");
        output
    };
    assert_eq!(record("a.gif"), "a.gif\n");
    record("b.gif");
    assert_eq!(
        fs::read(at("a.gif")).unwrap(),
        fs::read(at("b.gif")).unwrap()
    );
    assert_eq!(
        record("pngs"),
        "pngs/frame-000090.png\npngs/frame-000095.png\n"
    );

    let emulate = [
        "emulate", "--scene", "knot", "--frames", "90..96", "--out", "own",
    ];
    assert_eq!(crystal_ball(folder.path(), &emulate).0, Some(0));
    let gif = fs::File::open(at("a.gif")).unwrap();
    let mut decoder = gif::DecodeOptions::new();
    decoder.set_color_output(gif::ColorOutput::Indexed);
    let mut decoder = decoder.read_info(gif).unwrap();
    let colours = decoder.global_palette().unwrap().to_vec();
    let mut shown = vec![0; 320 * 240];
    for name in ["frame-000090.png", "frame-000095.png"] {
        let expected = frame(&at("own").join(name));
        assert_eq!(frame(&at("pngs").join(name)), expected);
        let wide: Vec<u8> = expected
            .palette
            .iter()
            .flatten()
            .map(|&part| widen(part))
            .collect();
        assert_eq!(colours, wide);
        let frame = decoder.read_next_frame().unwrap().unwrap();
        for (i, &pixel) in frame.buffer.iter().enumerate() {
            let (x, y) = (i % usize::from(frame.width), i / usize::from(frame.width));
            let place = (y + usize::from(frame.top)) * 320 + x + usize::from(frame.left);
            if Some(pixel) != frame.transparent {
                shown[place] = pixel;
            }
        }
        assert_eq!(shown, expected.pixels, "{name}");
    }

    // Six dumps with their PNGs give six images, each with its name below it.
    let (code, output, errors) =
        crystal_ball(folder.path(), &["replay", "own", "--sheet", "sheet.png"]);
    assert_eq!(
        (code, output.as_str()),
        (Some(0), "sheet.png\n"),
        "{errors}"
    );
    let sheet = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(at("sheet.png")).unwrap(),
    ));
    let size = sheet.read_info().unwrap().info().size();
    assert_eq!(size, (3 * 324 + 4, 2 * 264 + 4));
}

#[test]
fn an_impossible_recording_or_replay_is_an_error_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.dump"), "not one").unwrap();
    fs::create_dir(folder.path().join("empty")).unwrap();
    for (line, code, why) in [
        ("record --out a.mp4", 2, "--out a.mp4: cannot record a .mp4"),
        (
            "record --every 1 --out a.gif",
            2,
            "--every 1: too fast for a GIF",
        ),
        (
            "record --frames 5..5 --out a.gif",
            2,
            "the range has no frame",
        ),
        (
            "record --frames 0..3 --out no/where/a.gif",
            1,
            "no/where/a.gif cannot be written",
        ),
        (
            "replay empty --sheet s.png",
            1,
            "no .dump or .png file to show",
        ),
        ("replay gone --sheet s.png", 1, "gone: cannot be read"),
        ("replay a.dump --sheet s.png", 1, "a.dump: line 1: "),
        ("replay a.dump", 1, "standard output is not a terminal"),
    ] {
        let arguments: Vec<_> = line.split(' ').collect();
        let (found, output, errors) = crystal_ball(folder.path(), &arguments);
        assert_eq!(
            (found, output.as_str()),
            (Some(code), ""),
            "{line}: {errors}"
        );
        assert!(errors.contains(why), "{line}: {errors}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}
