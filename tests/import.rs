//! Users' files: the files that make a model, the files that are refused, and the messages.

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command as Process, Stdio};

use rustix::process::{Pid, Signal};
use tempfile::TempDir;

/// Returns a folder with a model's files.
fn files() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("thing.obj"), CUBE).unwrap();
    let pixels: Vec<u8> = (0..40 * 30 * 3).map(|i| (i / 5) as u8).collect();
    write_png(
        &folder.path().join("thing.png"),
        (40, 30),
        png::ColorType::Rgb,
        &pixels,
    );
    folder
}

/// Writes a PNG with 8 bits a channel.
fn write_png(path: &Path, (width, height): (u32, u32), colour: png::ColorType, pixels: &[u8]) {
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), width, height);
    encoder.set_color(colour);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(pixels).unwrap();
    writer.finish().unwrap();
}

/// Runs the program in a folder; returns its exit code and its messages.
fn run(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = Process::new(env!("CARGO_BIN_EXE_crystal-ball"))
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program can be started");
    (
        output.status.code(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

/// Returns a PNG of these chunks.
fn png_of(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    for (kind, data) in chunks {
        let mut checksum = protocol::Checksum::new();
        checksum.add(*kind);
        checksum.add(data);
        bytes.extend((data.len() as u32).to_be_bytes());
        bytes.extend(*kind);
        bytes.extend(*data);
        bytes.extend(checksum.value().to_be_bytes());
    }
    bytes
}

/// Returns a PNG's header: size, depth and colour type.
fn png_header(width: u32, height: u32, depth: u8, colour: u8) -> Vec<u8> {
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    [&size[..], &[depth, colour, 0, 0, 0]].concat()
}

/// Returns a PNG whose header gives a size, but which contains no pixels.
fn empty_png(width: u32, height: u32) -> Vec<u8> {
    let header = png_header(width, height, 8, 2);
    png_of(&[(b"IHDR", &header), (b"IDAT", &[]), (b"IEND", &[])])
}

/// Returns a PNG with a palette of `bytes` bytes.
fn palette_png(bytes: usize) -> Vec<u8> {
    let header = png_header(1, 1, 8, 3);
    let palette = vec![9; bytes];
    // One pixel, of entry 0, stored and not compressed.
    let pixel = [0x78, 1, 1, 2, 0, 0xfd, 0xff, 0, 0, 0, 2, 0, 1];
    png_of(&[
        (b"IHDR", &header),
        (b"PLTE", &palette),
        (b"IDAT", &pixel),
        (b"IEND", &[]),
    ])
}

/// Triangles that have no vertex in common.
fn apart(triangles: usize) -> String {
    let vertex = |i: usize| format!("v {} {} {}\n", i % 97, i / 97, i * i % 89);
    (0..triangles)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2].map(vertex).concat() + "f -1 -2 -3\n")
        .collect()
}

/// A cube; each side shows the whole texture.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n\
                    v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
                    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                    f 5/1 6/2 7/3 8/4\nf 2/1 1/2 4/3 3/4\nf 1/1 5/2 8/3 4/4\n\
                    f 6/1 2/2 3/3 7/4\nf 8/1 7/2 3/3 4/4\nf 1/1 2/2 6/3 5/4\n";

/// Runs `emulate` on a model in a folder; returns the exit code, the messages, and the frame.
fn emulate(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, Option<Vec<u8>>) {
    let out = folder.join("dumps");
    let _ = fs::remove_dir_all(&out);
    let all = [&["emulate", "--frame", "0"][..], arguments].concat();
    let (code, stderr) = run(folder, &all);
    let unsafe_byte = |byte: u8| byte < b' ' && byte != b'\n' || byte == 0x7f;
    assert!(!stderr.bytes().any(unsafe_byte), "{stderr:?}");
    // The limit is the length of the longest intended message: a message never repeats much of a file.
    assert!(stderr.lines().all(|line| line.len() < 400), "{stderr}");
    (code, stderr, fs::read(out.join("frame-000000.dump")).ok())
}

#[test]
fn a_cube_is_drawn_alike_from_every_spelling_of_its_file() {
    let folder = files();
    let path = folder.path();
    let shown = |text: &[u8]| {
        fs::write(path.join("a.obj"), text).unwrap();
        let (code, stderr, frame) = emulate(path, &["--model", "a.obj"]);
        assert_eq!(code, Some(0), "{stderr}");
        (stderr, frame.expect("a frame was written"))
    };
    let (plain, frame) = shown(CUBE.as_bytes());
    assert_eq!(
        plain.lines().next(),
        Some("a.obj: 8 vertices, 6 faces, built-in texture 256 x 256")
    );
    assert!(!plain.contains("note: "), "{plain}");
    let normal = |index: &str| CUBE.replace("/1 ", &format!("/1/{index} "));
    for text in [
        format!("\u{feff}{CUBE}"),
        CUBE.replace('\n', "\r"),
        CUBE.replace('\n', "\r\n"),
        CUBE.replace(' ', "\x0b"),
        CUBE.replace(" 1\n", " \\ \n1\n"),
        format!("usemtl mats\\\n{CUBE}"),
        format!("vn nan nan nan\nvn -nan(ind) 0 -1.#IND\n{}", normal("1")),
        normal("0"),
        normal("99"),
        format!("{CUBE}v 1.#QNAN0 0x10 1,5\nvt x\n"),
    ] {
        let (stderr, same) = shown(text.as_bytes());
        assert_eq!(stderr, plain, "{text:?}");
        assert!(same == frame, "{text:?}");
    }
    let tagged = format!("t crease 2/1/0 1 2 2.0\nvw 1\n{CUBE}\x1b[31m 1\nvw 2\nl 1 2\n");
    let (stderr, same) = shown(tagged.as_bytes());
    let left_out =
        r"6 faces, 5 statements skipped (1 't', 2 'vw', 1 '\x1b[31m', 1 'l'), built-in texture";
    assert!(stderr.contains(left_out), "{stderr}");
    assert!(same == frame);
    // The scene can also be chosen by name.
    let (code, _, same) = emulate(path, &["--model", "a.obj", "--scene", "model"]);
    assert_eq!((code, same.as_ref()), (Some(0), Some(&frame)));
    let (code, _, ball) = emulate(path, &["--model", "a.obj", "--scene", "ball"]);
    assert!(code == Some(0) && ball.is_some_and(|ball| ball != frame));
}

#[test]
fn faces_that_look_away_are_reported_with_the_winding_rule() {
    let folder = files();
    let path = folder.path();
    let turned = |text: &str| {
        let lines = text.lines().map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.rsplit(' ').collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        });
        lines.collect::<String>()
    };
    let sheet = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";
    for (text, expected) in [
        (sheet.to_string(), None),
        (CUBE.to_string(), None),
        (
            turned(sheet),
            Some("note: every face looks away in the first frame."),
        ),
        (
            turned(CUBE),
            Some("note: every face looks inward, so the model is inside out."),
        ),
        // Some faces are the right way round.
        (format!("{}f 1 2 3 4\n", turned(sheet)), None),
    ] {
        fs::write(path.join("a.obj"), &text).unwrap();
        let (code, stderr, _) = emulate(path, &["--model", "a.obj"]);
        assert_eq!(code, Some(0), "{stderr}");
        let note = stderr.lines().find(|line| line.starts_with("note: "));
        assert_eq!(note.is_some(), expected.is_some(), "{stderr}");
        if let (Some(note), Some(expected)) = (note, expected) {
            assert!(
                note.starts_with(expected) && note.contains("counter-clockwise"),
                "{note}"
            );
        }
    }
}

#[test]
fn colours_under_full_transparency_are_not_drawn() {
    let folder = files();
    let path = folder.path();
    fs::write(path.join("a.obj"), CUBE).unwrap();
    // Half hidden magenta, half green; and the same with grey in place of the magenta.
    let write = |name: &str, hidden: [u8; 4]| {
        let pixel = |i: usize| match i % 64 < 32 {
            true => hidden,
            false => [20, 200, 40, 255],
        };
        let pixels: Vec<u8> = (0..64 * 64).flat_map(pixel).collect();
        write_png(&path.join(name), (64, 64), png::ColorType::Rgba, &pixels);
    };
    write("clear.png", [255, 0, 255, 0]);
    write("grey.png", [128, 128, 128, 255]);
    let [clear, grey] = ["clear.png", "grey.png"].map(|texture| {
        let (code, stderr, frame) = emulate(path, &["--model", "a.obj", "--texture", texture]);
        assert_eq!(code, Some(0), "{stderr}");
        (stderr, frame.unwrap())
    });
    assert!(
        clear
            .0
            .contains("64 x 64, transparent parts blended with grey (808080)"),
        "{}",
        clear.0
    );
    assert!(!grey.0.contains("transparent"), "{}", grey.0);
    assert!(clear.1 == grey.1);
}

#[test]
fn unusable_files_are_refused_with_file_line_and_reason_and_nothing_is_written() {
    let folder = files();
    let path = folder.path();
    let png = fs::read(path.join("thing.png")).unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 65 0\n";
    let repeats = format!("{triangle}f 1/1 2/2 3/1\n");
    let apart = apart(1366);
    let many = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(8193));
    let corners = format!("{CUBE}f{}\n", " 1/1 2/2 3/3 4/4".repeat(4000));
    let word = format!("v {} 0 0\n", "x".repeat(20_000));
    let infinite = format!("v 0 0 1.#INF00\n{CUBE}f 1 2 3\n");
    let page = format!("<!DOCTYPE html><pre>\n{CUBE}</pre>");
    let wide: Vec<u8> = CUBE.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let marked = [b"\xff\xfe", &wide[..]].concat();
    let mut stl = b"solid in name only".to_vec();
    stl.resize(80, b' ');
    stl.extend([1, 0, 0, 0]);
    stl.resize(84 + 50, 0);
    let objs: &[(&str, &[u8], &str)] = &[
        (
            "text.obj",
            b"hello\n",
            "1: 'hello' is not a statement of a Wavefront OBJ",
        ),
        ("binary.obj", b"v 0 0 0\n\0\0", " the file has no faces"),
        (
            "escape.obj",
            b"\x1b[31mEVIL\x1b[0m 1 2\n",
            r"1: '\x1b[31mEVIL\x1b[0m' is not a statement",
        ),
        (
            "long.obj",
            word.as_bytes(),
            "1: 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...' (20000 bytes) is not a number",
        ),
        (
            "infinite.obj",
            infinite.as_bytes(),
            "1: '1.#INF00' is not a number",
        ),
        (
            "corners.obj",
            corners.as_bytes(),
            "19: the face has 16000 corners",
        ),
        (
            "page.obj",
            page.as_bytes(),
            " the file is HTML, not a Wavefront OBJ",
        ),
        (
            "ascii.obj",
            b"solid a\n facet normal 0 0 1\n",
            " the file is STL, not",
        ),
        ("stl.obj", &stl, " the file is binary STL, not"),
        (
            "ply.obj",
            b"ply\nformat ascii 1.0\n",
            " the file is PLY, not",
        ),
        ("gltf.obj", b"{\n\"asset\": {}}", " the file is JSON, not"),
        ("zip.obj", b"PK\x03\x04\x14\0\0\0", " the file is ZIP, not"),
        (
            "fbx.obj",
            b"Kaydara FBX Binary  \0\x1a\0",
            " the file is FBX, not",
        ),
        (
            "png.obj",
            &png,
            " the file is PNG, not a Wavefront OBJ; pass an image with --texture",
        ),
        (
            "wide.obj",
            &marked,
            " the file is UTF-16 text, not a Wavefront OBJ; save it as UTF-8",
        ),
        ("unmarked.obj", &wide, " the file is UTF-16 text, not"),
        (
            "index.obj",
            b"v 0 0 0\nv 1 0 0\nf 1 2 3\n",
            "3: position 3 does not exist: the file has 2",
        ),
        (
            "back.obj",
            b"v 0 0 0\nf -1 -2 -1\n",
            "2: '-2': the position -2 does not exist: the file has 1",
        ),
        (
            "nan.obj",
            b"v 0 0 0\n\nv 0 nan 0\nf 1 2 1",
            "3: 'nan' is not within",
        ),
        ("empty.obj", b"# nothing\n", " the file has no faces"),
        (
            "flat.obj",
            b"v 0 0 0\nv 1 0 0\nf 1 2 1\nf 1 2\n",
            " none of the 2 faces has an area",
        ),
        (
            "faces.obj",
            many.as_bytes(),
            "8196: with this face the model has more than 8192 faces",
        ),
        (
            "vertices.obj",
            apart.as_bytes(),
            "5464: with this face the model has more than 4096 vertices (the file has 4098)",
        ),
        (
            "repeats.obj",
            repeats.as_bytes(),
            "6: the face repeats the texture 65 times",
        ),
    ];
    for (name, bytes, why) in objs {
        fs::write(path.join(name), bytes).unwrap();
        let (code, stderr, _) = emulate(path, &["--model", name]);
        assert_eq!(code, Some(1), "{stderr}");
        assert!(
            stderr.starts_with(&format!("error: {name}:{why}")),
            "{stderr}"
        );
        assert!(stderr.contains("; "), "no remedy in: {stderr}");
    }
    let pngs: &[(&str, &[u8], &str)] = &[
        (
            "no.png",
            b"GIF89a, or so",
            "the file is GIF, not a PNG; convert it to PNG",
        ),
        (
            "jpeg.png",
            b"\xff\xd8\xff\xe0\0\x10JFIF\0",
            "the file is JPEG, not a PNG;",
        ),
        (
            "webp.png",
            b"RIFF\x10\0\0\0WEBPVP8 ",
            "the file is WebP, not a PNG;",
        ),
        (
            "tiff.png",
            b"II*\0\x08\0\0\0",
            "the file is TIFF, not a PNG;",
        ),
        (
            "svg.png",
            b"<svg xmlns='http://www.w3.org/2000/svg'/>",
            "the file is SVG, not a PNG;",
        ),
        (
            "obj.png",
            b"v 0 0 0\n\x1b[2J",
            r"the file begins with 'v 0 0 0\x0a\x1b[2J', unlike every PNG;",
        ),
        ("none.png", b"", "the file is empty; "),
        ("cut.png", &png[..png.len() / 2], "the PNG is damaged: "),
        ("head.png", &png[..30], "the PNG is damaged: "),
        ("zero.png", &empty_png(0, 5), "the PNG is damaged: "),
        ("palette-1.png", &palette_png(1), "the PNG is damaged: "),
        (
            "palette-4.png",
            &palette_png(4),
            "the palette has 4 bytes, but needs three",
        ),
        (
            "palette-767.png",
            &palette_png(767),
            "the palette has 767 bytes, but needs three",
        ),
        ("palette-771.png", &palette_png(771), "the PNG is damaged: "),
        (
            "wide.png",
            &empty_png(20_000, 1),
            "the PNG has 20000 x 1 pixels, but at most 8192 on a side are allowed",
        ),
        (
            "high.png",
            &empty_png(20_000, 20_000),
            "the PNG has 20000 x 20000 pixels",
        ),
    ];
    for (name, bytes, why) in pngs {
        fs::write(path.join(name), bytes).unwrap();
        let (code, stderr, _) = emulate(path, &["--model", "thing.obj", "--texture", name]);
        assert_eq!(code, Some(1), "{stderr}");
        assert!(
            stderr.starts_with(&format!("error: {name}: {why}")),
            "{stderr}"
        );
        assert_eq!(
            stderr.matches("not a PNG").count(),
            usize::from(why.contains("not a PNG")),
            "{stderr}"
        );
    }
    for bytes in [3, 768] {
        fs::write(path.join("good.png"), palette_png(bytes)).unwrap();
        let (code, stderr, frame) =
            emulate(path, &["--model", "thing.obj", "--texture", "good.png"]);
        assert!(code == Some(0) && frame.is_some(), "{stderr}");
    }
    fs::remove_dir_all(path.join("dumps")).unwrap();
    for (arguments, code, why) in [
        (
            &["--model", "gone.obj"][..],
            1,
            "error: gone.obj: cannot be read: No such file",
        ),
        (
            &["--model", "\x1b[31mgone\n.obj"],
            1,
            r"error: \x1b[31mgone\x0a.obj: cannot be read: No such file",
        ),
        (
            &["--model", "."],
            1,
            "error: .: cannot be read: Is a directory",
        ),
        (
            &["--texture", "thing.png"],
            2,
            "--texture needs a model; add --model FILE.obj",
        ),
        (
            &["--scene", "model"],
            2,
            "--scene model needs a model; add --model FILE.obj",
        ),
    ] {
        let (ended, stderr, _) = emulate(path, arguments);
        assert_eq!(ended, Some(code), "{stderr}");
        assert!(stderr.contains(why), "{stderr}");
    }
    assert!(!path.join("dumps").exists(), "something was written");
}

/// Starts `emulate` on a model that comes through a pipe, and interrupts it when it has read what `feed`
/// writes. The program opens the pipe only when it can receive signals.
fn interrupted(signal: Signal, feed: impl FnOnce(fs::File) -> Option<fs::File>) {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.obj");
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
    let mut process = Process::new(env!("CARGO_BIN_EXE_crystal-ball"))
        .current_dir(folder.path())
        .args(["emulate", "--frame", "0", "--model", "pipe.obj"])
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let open = feed(fs::File::options().write(true).open(&pipe).unwrap());
    rustix::process::kill_process(Pid::from_child(&process), signal).unwrap();
    let mut text = String::new();
    let mut stderr = process.stderr.take().unwrap();
    stderr.read_to_string(&mut text).unwrap();
    assert_eq!(
        (process.wait().unwrap().code(), &text[..]),
        (Some(130), "interrupted\n")
    );
    drop(open);
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        1,
        "something was written"
    );
}

#[test]
fn an_interrupt_ends_the_import_while_it_reads_and_while_it_works() {
    // The pipe stays open: more data could follow.
    interrupted(Signal::TERM, |mut pipe| {
        pipe.write_all(CUBE.as_bytes()).unwrap();
        Some(pipe)
    });
    // The data is complete, and cutting it would last half a minute.
    let face = format!("f{}\n", " 1 2 3".repeat(682));
    let slow = format!("{CUBE}{}", face.repeat(12));
    interrupted(Signal::INT, |mut pipe| {
        pipe.write_all(slow.as_bytes()).unwrap();
        None
    });
}

#[test]
fn messages_escape_unprintable_bytes_of_dumps_and_descriptions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let evil = "\x1b]0;title\x07";
    fs::write(path.join("a.dump"), format!("crystal-ball-dump {evil}\n")).unwrap();
    fs::create_dir(path.join("golden")).unwrap();
    let toml = format!("about = \"a\"\n{evil} = 1\n");
    fs::write(path.join("golden").join("a.toml"), toml).unwrap();
    fs::create_dir(path.join("keys")).unwrap();
    let toml = "about = \"a\"\nshow = [\"\\u001b[31m\"]\n";
    fs::write(path.join("keys").join(format!("{evil}.toml")), toml).unwrap();
    for (arguments, code, why) in [
        (
            &["diff", "a.dump", "a.dump"][..],
            2,
            "the line contains the byte 1b",
        ),
        (
            &["diff", evil, "a.dump"],
            2,
            r"\x1b]0;title\x07: cannot be read",
        ),
        (&["bless", "golden"], 1, "line 2: "),
        (&["bless", "keys"], 1, r"'\x1b[31m' is not a frame's name"),
        (&["--scene", evil], 2, "for '--scene <NAME>'"),
    ] {
        let (ended, stderr) = run(path, arguments);
        assert_eq!(ended, Some(code), "{stderr}");
        assert!(stderr.contains(why), "{stderr}");
        assert!(!stderr.contains(['\x1b', '\x07']), "{stderr:?}");
    }
}
