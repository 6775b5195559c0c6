//! A model of the user's own: in real QEMU as on the emulated card, and what can't be one.

use std::fs;
use std::path::Path;
use std::process::{Command as Process, Stdio};

use crystal_ball::card::{self, Card, Emulated};
use crystal_ball::machine::{Config, Machine};
use crystal_ball::model::Model;
use crystal_ball::screen::Screen;
use crystal_ball::setup::Options;
use link::{Command, Content, Picture, Setting, Word};
use tempfile::TempDir;

use crate::ready;

/// A pyramid on a star: two objects, a concave face, and faces with and without texture coordinates,
/// some of them beyond the texture's border.
const OBJ: &str = "
o star
v 0 0 2\nv .5 0 .5\nv 2 0 0\nv .5 0 -.5\nv 0 0 -2\nv -.5 0 -.5\nv -2 0 0\nv -.5 0 .5
f 8 7 6 5 4 3 2 1
o pyramid
v 0 1.5 0
vt 0 0\nvt 2.5 0\nvt 1.25 1
f 1/1 2/2 -1/3\nf 2/1 3/2 -1/3\nf 3/1 4/2 -1/3\nf 4/1 5/2 -1/3
f 5/1 6/2 -1/3\nf 6/1 7/2 -1/3\nf 7 8 -1\nf 8 1 -1
";

/// A folder with a model's files.
fn files() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("thing.obj"), OBJ).unwrap();
    let screen = Screen {
        width: 40,
        height: 30,
        pixels: (0..40 * 30)
            .map(|i| [i % 40 * 6, i / 40 * 8, 128].map(|part: usize| part as u8))
            .collect(),
    };
    let png = fs::File::create(folder.path().join("thing.png")).unwrap();
    screen.write_png(png).unwrap();
    folder
}

fn model() -> Model {
    let folder = files();
    let [obj, png] = ["thing.obj", "thing.png"].map(|name| folder.path().join(name));
    Model::load(&obj, Some(&png)).unwrap()
}

/// A machine whose ramdisk holds these bytes. It has to take the pack of a checksum, if one is given.
fn boot(ramdisk: Vec<u8>, pack: Option<u32>) -> Machine {
    let options = Options {
        ramdisk: Some(ramdisk),
        ..Options::default()
    };
    let ready = ready::with(&options);
    let config = Config {
        pack,
        ..Config::new(&ready)
    };
    Machine::boot(&config).expect("boots")
}

#[test]
fn a_model_is_shown_by_both_cards_alike_and_named_in_their_dumps() {
    let model = model();
    let pack = model.pack();
    let mut machine = boot(model.bytes.clone(), Some(pack.checksum()));
    let mut memory = card::memory();
    let mut emulated = Emulated::with(&mut memory, Some(&pack)).unwrap();
    let pictures = [
        Picture::Frame(0),
        Picture::Frame(250),
        Picture::Pose {
            yaw: 0x2345_6789,
            pitch: 0x1000_0000,
            roll: 0x8000_0000,
            distance: 0x1_2000,
        },
    ];
    for picture in pictures {
        let [seen, told]: [_; 2] =
            [&mut machine as &mut dyn Asked, &mut emulated].map(|card| card.dump_of(picture));
        assert_eq!(seen, told, "{picture}");
        assert_eq!(seen.header.scene, "model");
        assert_eq!(seen.header.pack, Some(pack.checksum()));
        assert_eq!(machine.screen().unwrap(), emulated.screen().unwrap());
    }
    // A built-in scene is nobody's model, whatever the ramdisk holds.
    let ball = Command::Set(Setting::Scene, Word::new("ball"));
    for card in [&mut machine as &mut dyn Asked, &mut emulated] {
        let scenes = card.asked(Command::Set(Setting::Scene, None));
        assert!(scenes.last().unwrap().starts_with("*model "), "{scenes:?}");
        card.asked(ball);
        assert_eq!(card.dumped().header.pack, None);
    }
    machine.leave().unwrap();
}

/// Both cards, in one list.
trait Asked {
    fn asked(&mut self, command: Command) -> Vec<String>;
    fn dumped(&mut self) -> crystal_ball::dump::Dump;
    fn dump_of(&mut self, picture: Picture) -> crystal_ball::dump::Dump {
        self.asked(Command::Hold);
        self.asked(Command::Show(picture));
        self.dumped()
    }
}

impl<C: Card> Asked for C {
    fn asked(&mut self, command: Command) -> Vec<String> {
        self.ask(command).unwrap()
    }

    fn dumped(&mut self) -> crystal_ball::dump::Dump {
        self.dump(Content::Page).unwrap()
    }
}

#[test]
fn a_damaged_ramdisk_is_told_and_the_built_in_scenes_are_there() {
    let mut bytes = model().bytes;
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    let mut machine = boot(bytes, None);
    machine.wait_until_running().unwrap();
    let said = machine.said_of_pack().unwrap().to_string();
    assert!(
        said.starts_with("refused pack: its header says checksum "),
        "{said}"
    );
    let mut memory = card::memory();
    let mut emulated = Emulated::new(&mut memory).unwrap();
    let ball = emulated.dump_of(Picture::Frame(480));
    assert_eq!(ball.header.scene, "ball");
    assert_eq!(machine.dump_of(Picture::Frame(480)), ball);
    machine.leave().unwrap();
}

/// Runs the program in a folder; its exit code and its words.
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

/// A PNG that says it has so many pixels, and has none.
fn empty_png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        let mut checksum = link::Checksum::new();
        checksum.add(kind);
        checksum.add(data);
        bytes.extend((data.len() as u32).to_be_bytes());
        bytes.extend(kind);
        bytes.extend(data);
        bytes.extend(checksum.value().to_be_bytes());
    };
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    chunk(b"IHDR", &[&size[..], &[8, 2, 0, 0, 0]].concat());
    chunk(b"IDAT", &[]);
    chunk(b"IEND", &[]);
    bytes
}

/// Triangles that have no vertex in common.
fn apart(triangles: usize) -> String {
    let vertex = |i: usize| format!("v {} {} {}\n", i % 97, i / 97, i * i % 89);
    (0..triangles)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2].map(vertex).concat() + "f -1 -2 -3\n")
        .collect()
}

#[test]
fn what_is_no_model_is_told_by_file_line_and_reason_and_nothing_is_written() {
    let folder = files();
    let path = folder.path();
    let png = fs::read(path.join("thing.png")).unwrap();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 65 0\n";
    let repeats = format!("{triangle}f 1/1 2/2 3/1\n");
    let apart = apart(1366);
    let many = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(8193));
    let objs: [(&str, &[u8], &str); 11] = [
        (
            "text.obj",
            b"hello\n",
            "line 1: 'hello' is no statement of a Wavefront OBJ",
        ),
        ("binary.obj", b"v 0 0 0\n\0\0", "line 2: it has a zero byte"),
        (
            "index.obj",
            b"v 0 0 0\nv 1 0 0\nf 1 2 3\n",
            "line 3: position 3: there are 2 of them",
        ),
        (
            "back.obj",
            b"v 0 0 0\nf -1 -2 -1\n",
            "line 2: '-2': position -2: there are 1 before it",
        ),
        (
            "nan.obj",
            b"v 0 0 0\n\nv 0 nan 0\n",
            "line 3: 'nan' is not finite",
        ),
        ("inf.obj", b"v 0 inf 0\n", "line 1: 'inf' is not finite"),
        ("empty.obj", b"# nothing\n", "it has no faces"),
        (
            "flat.obj",
            b"v 0 0 0\nv 1 0 0\nf 1 2 1\nf 1 2\n",
            "none of its 2 faces has an area",
        ),
        (
            "faces.obj",
            many.as_bytes(),
            "its 8193 faces make 8193 flat convex ones with 24579 corners; a model has at most 8192",
        ),
        (
            "vertices.obj",
            apart.as_bytes(),
            "it has 4098 vertices; a model has at most 4096",
        ),
        (
            "repeats.obj",
            repeats.as_bytes(),
            "line 6: the face repeats the texture 65 times; at most 64",
        ),
    ];
    for (name, bytes, why) in objs {
        fs::write(path.join(name), bytes).unwrap();
        let (code, words) = run(path, &["emulate", "--frame", "0", "--model", name]);
        assert_eq!(code, Some(1), "{words}");
        assert!(words.contains(&format!("error: {name}: {why}")), "{words}");
    }
    let pngs: [(&str, &[u8], &str); 6] = [
        ("no.png", b"GIF89a, or so", "it is no PNG"),
        ("cut.png", &png[..png.len() / 2], "it is no whole PNG"),
        ("head.png", &png[..30], "it is no PNG"),
        ("zero.png", &empty_png(0, 5), "it is no PNG"),
        (
            "wide.png",
            &empty_png(20_000, 1),
            "it has 20000 x 1 pixels; a texture has at most 8192 a side",
        ),
        (
            "high.png",
            &empty_png(20_000, 20_000),
            "it has 20000 x 20000 pixels",
        ),
    ];
    for (name, bytes, why) in pngs {
        fs::write(path.join(name), bytes).unwrap();
        let arguments = [
            "--model",
            "thing.obj",
            "emulate",
            "--frame",
            "0",
            "--texture",
            name,
        ];
        let (code, words) = run(path, &arguments);
        assert_eq!(code, Some(1), "{words}");
        assert!(words.contains(&format!("error: {name}: {why}")), "{words}");
    }
    for (arguments, code, why) in [
        (
            ["--model", "gone.obj"],
            1,
            "error: gone.obj: it cannot be read: No such file",
        ),
        (
            ["--model", "."],
            1,
            "error: .: it cannot be read: Is a directory",
        ),
        (["--texture", "thing.png"], 2, "--texture is for a --model"),
    ] {
        let all = [&["emulate", "--frame", "0"][..], &arguments].concat();
        let (ended, words) = run(path, &all);
        assert_eq!(ended, Some(code), "{words}");
        assert!(words.contains(why), "{words}");
    }
    assert!(!path.join("dumps").exists(), "something was written");
}
