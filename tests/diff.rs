//! `diff` from the outside: the program's messages, where they go, and its exit codes.

use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use frames::dump::Dump;
use frames::indexed::IndexedImage;
use frames::rgb::RgbImage;
use protocol::Content;
use tempfile::TempDir;

/// A folder of files to compare; the program runs in it.
struct World(TempDir);

impl World {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file, and creates its folder.
    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    fn read(&self, name: &str) -> String {
        String::from_utf8(fs::read(self.path(name)).unwrap()).unwrap()
    }

    fn diff(&self, arguments: &[&str]) -> Exit {
        let mut program = Command::new(env!("CARGO_BIN_EXE_crystal-ball"));
        program.arg("diff").args(arguments).stdin(Stdio::null());
        let Output {
            status,
            stdout,
            stderr,
        } = program.current_dir(self.0.path()).output().unwrap();
        Exit {
            code: status.code(),
            out: String::from_utf8(stdout).unwrap(),
            errors: String::from_utf8(stderr).unwrap(),
        }
    }
}

/// The program's exit code and output.
#[derive(Debug, PartialEq, Eq)]
struct Exit {
    code: Option<i32>,
    out: String,
    errors: String,
}

#[track_caller]
fn check(exit: Exit, code: i32, out: &str, errors: &str) {
    let expected = Exit {
        code: Some(code),
        out: out.into(),
        errors: errors.into(),
    };
    assert_eq!(exit, expected);
}

/// Returns a page's dump as a file, after `change`.
fn page(change: impl FnOnce(&mut Dump)) -> Vec<u8> {
    file(Content::Page, change)
}

fn file(content: Content, change: impl FnOnce(&mut Dump)) -> Vec<u8> {
    let (mut dump, mut bytes) = (Dump::example(content), Vec::new());
    change(&mut dump);
    dump.write(&mut bytes).unwrap();
    bytes
}

/// Returns a PNG as a file, after `change`.
fn png(change: impl FnOnce(&mut IndexedImage)) -> Vec<u8> {
    let (mut frame, mut bytes) = (Dump::example(Content::Page).frame(), Vec::new());
    change(&mut frame);
    frame.write_png(&mut bytes).unwrap();
    bytes
}

const FIRST: &str = "1 of 76800 pixels differs, first plane 1, x 1, y 1: expected 46, got 47";

fn one_pixel(dump: &mut Dump) {
    dump.pixels[321] ^= 1;
}

#[test]
fn equal_files_have_exit_code_0() {
    let world = World::new();
    world.put("a.dump", page(|_| {}));
    // With the line ends of a terminal.
    let text = String::from_utf8(page(|_| {})).unwrap();
    world.put("b.dump", text.replace('\n', "\r\n"));
    world.put("a.png", png(|_| {}));
    world.put("all.dump", file(Content::Memory, |_| {}));
    for (a, b, pixels) in [
        ("a.dump", "b.dump", 76_800),
        ("a.png", "a.png", 76_800),
        ("a.png", "a.dump", 76_800),
        ("all.dump", "all.dump", 262_144),
    ] {
        let line = format!("equal: {a} and {b}, {pixels} pixels\n");
        check(world.diff(&[a, b]), 0, &line, "");
    }
}

#[test]
fn a_difference_is_described_in_one_line() {
    let world = World::new();
    world.put("a", page(|_| {}));
    world.put("pixel", page(one_pixel));
    world.put("elsewhere", page(|dump| dump.header.start = 0));
    world.put("colour", page(|dump| dump.palette[3] = [0x2A, 0x1C, 0x0F]));
    world.put("a.png", png(|_| {}));
    world.put("pixel.png", png(|frame| frame.pixels[321] ^= 1));
    world.put("all", file(Content::Memory, |_| {}));
    let at = 4 * 0x4B50 + 2;
    world.put(
        "byte",
        file(Content::Memory, |dump| dump.pixels[at] ^= 0x80),
    );
    let palette = "1 of 256 palette entries differs, first 03: expected 000303, got 2a1c0f";
    for (a, b, line) in [
        ("a", "pixel", FIRST),
        ("a", "elsewhere", "start: expected 4b00, got 0000"),
        ("a", "colour", palette),
        ("a.png", "pixel.png", FIRST),
        ("a.png", "pixel", FIRST),
        ("a", "pixel.png", FIRST),
        (
            "all",
            "byte",
            "1 of 262144 bytes differs, first plane 2, address 4b50 (page 1, x 2, y 1): \
             expected 41, got c1; in plane 0: 0, 1: 0, 2: 1, 3: 0; in page 1: 1",
        ),
    ] {
        let line = format!("{b} differs from {a}: {line}\n");
        check(world.diff(&[a, b]), 1, &line, "");
    }
}

#[test]
fn folders_are_matched_by_name_and_every_pair_is_reported() {
    let world = World::new();
    for folder in ["a", "b"] {
        world.put(&format!("{folder}/1.dump"), page(|_| {}));
        world.put(&format!("{folder}/2.png"), png(|_| {}));
        world.put(&format!("{folder}/{folder}.txt"), "not compared");
        world.put(&format!("{folder}/sub/{folder}.dump"), "not compared");
    }
    let equal = "equal: 2 pairs, 153600 pixels\n";
    check(world.diff(&["a", "b"]), 0, equal, "");
    world.put("b/2.png", png(|frame| frame.pixels[321] ^= 1));
    let different = format!("2.png differs: {FIRST}\n1 of 2 pairs differs\n");
    check(world.diff(&["a", "b/"]), 1, &different, "");
    // Missing files are reported first, and the rest is compared nevertheless.
    world.put("a/0.dump", page(|_| {}));
    world.put("b/1.png", png(|_| {}));
    check(
        world.diff(&["a", "b"]),
        2,
        &format!("2.png differs: {FIRST}\n1 of 4 pairs differs, 2 could not be compared\n"),
        "error: 0.dump: in a, but missing from b\nerror: 1.png: in b, but missing from a\n",
    );
}

#[test]
fn a_comparison_without_files_is_an_error() {
    let world = World::new();
    world.put("a/x.txt", "");
    world.put("b/x.txt", "");
    check(
        world.diff(&["a", "b"]),
        2,
        "",
        "error: a and b: neither folder has a .dump or a .png file to compare\n",
    );
    world.put("file", page(|_| {}));
    let why = "error: a is a folder, file is a file; give two files or two folders\n";
    check(world.diff(&["a", "file"]), 2, "", why);
    check(world.diff(&["file", "a"]), 2, "", why);
    let gone = "error: gone: cannot be read: No such file or directory (os error 2)\n";
    check(world.diff(&["a", "gone"]), 2, "", gone);
    check(world.diff(&["gone", "a"]), 2, "", gone);
    assert_eq!(world.diff(&["a"]).code, Some(2), "wrong usage");
}

#[test]
fn files_that_cannot_be_compared_are_an_error_with_the_reason() {
    let world = World::new();
    world.put("a", page(|_| {}));
    world.put("all", file(Content::Memory, |_| {}));
    world.put(
        "low",
        page(|dump| {
            dump.header.height = 200;
            dump.pixels.truncate(320 * 200);
        }),
    );
    world.put("a.png", png(|_| {}));
    world.put("order.png", png(|frame| frame.palette.swap(3, 200)));
    let order = "the palettes hold the same colours in another order (entry 03: expected 000303, \
                 got 320800), so indices cannot be compared; give the PNG as this program wrote it";
    let size = "expected is 320 x 240 pixels, got is 320 x 200; both must have the same size";
    for (a, b, why) in [
        (
            "a",
            "all",
            "expected is a dump of a page, got a dump of all memory; take both with --all or both without",
        ),
        ("a", "low", size),
        ("a.png", "low", size),
        ("a.png", "order.png", order),
        ("a", "order.png", order),
    ] {
        let error = format!("error: {a} and {b} cannot be compared: {why}\n");
        check(world.diff(&[a, b]), 2, "", &error);
    }
}

#[test]
fn a_file_that_is_not_a_valid_dump_or_png_is_an_error_with_the_reason() {
    let world = World::new();
    let good = String::from_utf8(page(|_| {})).unwrap();
    let lines: Vec<_> = good.split_inclusive('\n').collect();
    let framed = |text: &str| {
        let mut line = Vec::new();
        protocol::write_line(format_args!("{text}"), |bytes| {
            line.extend_from_slice(bytes);
        });
        String::from_utf8(line).unwrap()
    };
    let frame = png(|_| {});
    let mut huge = frame.clone();
    // The header's size and its checksum.
    huge[16..24].copy_from_slice(&[0x7F, 0xFF, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF]);
    let mut checksum = protocol::Checksum::new();
    checksum.add(&huge[12..29]);
    huge[29..33].copy_from_slice(&checksum.value().to_be_bytes());
    let mut rgb = Vec::new();
    let screen = RgbImage {
        width: 1,
        height: 1,
        pixels: vec![[1, 2, 3]],
    };
    screen.write_png(&mut rgb).unwrap();
    let not_a_png = "and not a PNG; give a dump or an indexed PNG";
    for (name, bytes, parts) in [
        ("empty", Vec::new(), ["line 1: not a dump", not_a_png]),
        (
            "text",
            b"Hello!\n".to_vec(),
            ["line 1: not a dump", not_a_png],
        ),
        (
            "binary",
            (0..=255).cycle().take(99_999).collect(),
            ["line 1: not a dump", not_a_png],
        ),
        (
            "later",
            good.replacen(lines[0], &framed("crystal-ball dump 6"), 1)
                .into(),
            [
                "line 1: dump version 6 is not supported; this program reads versions 3 to 5",
                "take the dump again",
            ],
        ),
        (
            "cut",
            lines[..100].concat().into(),
            ["line 101: the dump is cut short", "take the dump again"],
        ),
        (
            "cut in a line",
            good[..99_999].into(),
            ["line 173: the dump is cut short", "take the dump again"],
        ),
        (
            "edited",
            good.replacen("line 007 e8", "line 007 e9", 1).into(),
            ["line 33: ", "take the dump again"],
        ),
        (
            "cut.png",
            frame[..frame.len() / 2].into(),
            ["the PNG is damaged or cut short", ""],
        ),
        (
            "end.png",
            frame[..frame.len() - 12].into(),
            ["the PNG is damaged or cut short", ""],
        ),
        (
            "head.png",
            frame[..20].into(),
            ["the PNG is damaged or cut short", ""],
        ),
        (
            "rgb.png",
            rgb,
            [
                "the PNG has Rgb pixels of 8 bits",
                "give an indexed PNG of 8 bits, as this program writes",
            ],
        ),
        (
            "huge.png",
            huge,
            [
                "the PNG's header claims 2147483647 x 2147483647 pixels; the limit is 16777216",
                "",
            ],
        ),
    ] {
        world.put(name, bytes);
        world.put("good", &good);
        for arguments in [[name, "good"], ["good", name]] {
            let exit = world.diff(&arguments);
            assert_eq!((exit.code, exit.out.as_str()), (Some(2), ""), "{exit:?}");
            let begin = format!("error: {name}: ");
            assert!(exit.errors.starts_with(&begin), "{exit:?}");
            assert_eq!(exit.errors.lines().count(), 1, "{exit:?}");
            for part in parts {
                assert!(exit.errors.contains(part), "{part}: {exit:?}");
            }
        }
    }
    // Both are reported. A folder's entry with the right extension may be a folder; a device has no end.
    let both = world.diff(&["gone", "text"]);
    assert!(
        both.errors
            .starts_with("error: gone: cannot be read: No such file")
    );
    assert!(both.errors.contains("\nerror: text: line 1: "), "{both:?}");
    let endless = world.diff(&["good", "/dev/zero"]);
    assert_eq!(endless.code, Some(2));
    assert!(
        endless.errors.contains("/dev/zero: the file has more than"),
        "{endless:?}"
    );
    fs::create_dir_all(world.path("x/1.dump")).unwrap();
    let folder = world.diff(&["x", "x"]);
    assert_eq!(folder.code, Some(2));
    assert!(
        folder.errors.contains("x/1.dump: cannot be read"),
        "{folder:?}"
    );
}

#[test]
fn a_report_shows_every_pair_that_differs() {
    let world = World::new();
    for (name, got) in [
        ("1.dump", page(one_pixel)),
        ("2.dump", page(|_| {})),
        (
            "<3>.dump",
            page(|dump| dump.palette[3] = [0x2A, 0x1C, 0x0F]),
        ),
    ] {
        world.put(&format!("a/{name}"), page(|_| {}));
        world.put(&format!("b/{name}"), got);
    }
    let byte = file(Content::Memory, |dump| dump.pixels[4 * 0x9600] ^= 1);
    world.put("a/4.dump", file(Content::Memory, |_| {}));
    world.put("b/4.dump", byte);
    world.put("a/5.png", png(|_| {}));
    world.put("b/5.png", png(|frame| frame.pixels.fill(7)));
    world.put("a/6.dump", page(|_| {}));
    let exit = world.diff(&["a", "b", "--report", "it differs.html"]);
    assert_eq!(exit.code, Some(2));
    assert!(
        exit.out
            .ends_with("4 of 6 pairs differ, 1 could not be compared\n")
    );
    assert!(
        exit.errors.ends_with("\nreport: it differs.html\n"),
        "{exit:?}"
    );
    let html = world.read("it differs.html");
    for part in [
        "<h1>4 of 6 pairs differ, 1 could not be compared</h1>",
        FIRST,
        "6.dump: in a, but missing from b",
        "&lt;3&gt;.dump",
        "All of video memory",
        "<td class=\"n\">1</td>",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert!(!html.contains("<3>") && !html.contains("2.dump"));
    let mut expected = Vec::new();
    for pair in ["1.dump", "3-.dump", "4.dump", "5.png"] {
        let memory = if pair == "4.dump" { "-memory" } else { "" };
        for of in ["expected", "got", "difference"] {
            expected.push(format!("{pair}-{of}{memory}.png"));
        }
        if pair != "5.png" {
            expected.extend(["expected", "got"].map(|of| format!("{pair}-{of}.dump")));
        }
    }
    expected.sort();
    let folder = fs::read_dir(world.path("it differs-files")).unwrap();
    let files = folder.map(|file| file.unwrap().file_name().into_string().unwrap());
    let mut files: Vec<_> = files.collect();
    files.sort();
    assert_eq!(files, expected);
    for file in &files {
        let address = format!("href=\"./it%20differs-files/{file}\"");
        assert!(html.contains(&address), "{address}");
    }
    // The copies equal the originals, and the PNGs those of the dumps.
    for (of, folder) in [("expected", "a"), ("got", "b")] {
        let copy = world.read(&format!("it differs-files/1.dump-{of}.dump"));
        assert!(copy == world.read(&format!("{folder}/1.dump")));
        let shown = fs::read(world.path(&format!("it differs-files/1.dump-{of}.png"))).unwrap();
        let shown = IndexedImage::read_png(Cursor::new(shown)).unwrap();
        assert!(shown == Dump::read(copy.as_bytes()).unwrap().frame());
    }
    let difference = decode(&world.path("it differs-files/1.dump-difference.png"));
    let bright = |pixel: &[u8; 3]| pixel[0] != pixel[1] || pixel[1] != pixel[2];
    let bright: Vec<_> = (0..)
        .zip(&difference)
        .filter(|(_, pixel)| bright(pixel))
        .collect();
    assert_eq!(bright.len(), 1);
    assert_eq!(bright[0].0, 321);
    let memory = decode(&world.path("it differs-files/4.dump-difference-memory.png"));
    assert_eq!(memory.len(), 320 * 820);
}

fn decode(path: &Path) -> Vec<[u8; 3]> {
    let bytes = fs::read(path).unwrap();
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels.as_chunks::<3>().0.to_vec()
}

#[test]
fn a_report_of_equal_files_says_so_and_has_no_folder() {
    let world = World::new();
    world.put("a.png", png(|_| {}));
    let exit = world.diff(&["a.png", "a.png", "--report", "r.html"]);
    assert_eq!(exit.code, Some(0), "{exit:?}");
    assert!(world.read("r.html").contains("<h1>Nothing differs</h1>"));
    assert!(!world.path("r-files").exists());
    // If files could not be compared, the report does not claim that nothing differs.
    let exit = world.diff(&["a.png", "gone", "--report", "r.html"]);
    assert_eq!(exit.code, Some(2), "{exit:?}");
    let html = world.read("r.html");
    assert!(!html.contains("Nothing differs") && html.contains("No such file"));
}

#[test]
fn a_report_that_cannot_be_written_is_an_error_after_the_differences() {
    let world = World::new();
    world.put("a", page(|_| {}));
    world.put("b", page(one_pixel));
    world.put("blocked-files", "a file where the folder should be");
    fs::create_dir(world.path("folder.html")).unwrap();
    for (report, start) in [
        (
            "nowhere/r.html",
            "error: nowhere/r-files: the folder cannot be created: No such",
        ),
        (
            "blocked.html",
            "error: blocked-files: the folder cannot be created: File exists",
        ),
        (
            "folder.html",
            "error: folder.html cannot be written: Is a directory",
        ),
        ("..", "error: --report ..: not a file name"),
    ] {
        let exit = world.diff(&["a", "b", "--report", report]);
        assert_eq!(exit.code, Some(2), "{exit:?}");
        assert_eq!(exit.out, format!("b differs from a: {FIRST}\n"));
        assert!(exit.errors.starts_with(start), "{exit:?}");
    }
    assert!(!world.path("blocked.html").exists());
    let equal = world.diff(&["a", "a", "--report", "nowhere/r.html"]);
    assert_eq!(equal.code, Some(2), "{equal:?}");
}
