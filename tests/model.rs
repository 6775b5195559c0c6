//! A user's model, in real QEMU and on the emulated VGA.

use std::fs;

use frames::backend::{self, Backend, EmulatedDemo};
use frames::rgb::RgbImage;
use import::Model;
use protocol::{Command, Content, FrameName, Setting, Word};
use qemu::{Config, Vm};
use setup::Options;
use tempfile::TempDir;

use crate::ready;

/// A pyramid on a star: two objects, a concave face, and faces with and without texture coordinates, some of
/// which lie beyond the texture's border.
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

/// Returns a folder with a model's files.
fn files() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("thing.obj"), OBJ).unwrap();
    let screen = RgbImage {
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

/// Boots a VM whose ramdisk contains these bytes. If `model_file` is a checksum, the kernel must accept the
/// model file with this checksum.
fn boot(ramdisk: Vec<u8>, model_file: Option<u32>) -> Vm {
    let options = Options {
        ramdisk: Some(ramdisk),
        ..Options::default()
    };
    let ready = ready::with(&options);
    let config = Config {
        model_file,
        ..Config::new(&ready)
    };
    Vm::boot(&config).expect("boots")
}

#[test]
fn qemu_and_the_emulated_vga_draw_a_model_alike_and_name_it_in_their_dumps() {
    let model = model();
    let model_file = model.file();
    let mut vm = boot(model.bytes.clone(), Some(model_file.checksum()));
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::with(&mut memory, Some(&model_file)).unwrap();
    let frames = [
        FrameName::Number(0),
        FrameName::Number(250),
        FrameName::Pose {
            yaw: 0x2345_6789,
            pitch: 0x1000_0000,
            roll: 0x8000_0000,
            distance: 0x1_2000,
        },
    ];
    for frame in frames {
        let [real, emulated_dump]: [_; 2] =
            [&mut vm as &mut dyn DynBackend, &mut emulated].map(|backend| backend.dump_of(frame));
        assert_eq!(real, emulated_dump, "{frame}");
        assert_eq!(real.header.scene, "model");
        assert_eq!(real.header.model_file, Some(model_file.checksum()));
        assert_eq!(vm.screen().unwrap(), emulated.screen().unwrap());
    }
    // A built-in scene has no model file, whatever the ramdisk contains.
    let ball = Command::Set(Setting::Scene, Word::new("ball"));
    for backend in [&mut vm as &mut dyn DynBackend, &mut emulated] {
        let scenes = backend.answer(Command::Set(Setting::Scene, None));
        assert!(scenes.last().unwrap().starts_with("*model "), "{scenes:?}");
        backend.answer(ball);
        assert_eq!(backend.dump_page().header.model_file, None);
    }
    vm.leave().unwrap();
}

/// A backend whose results are unwrapped. As a trait object, it allows both backends in one list.
trait DynBackend {
    fn answer(&mut self, command: Command) -> Vec<String>;
    fn dump_page(&mut self) -> frames::dump::Dump;
    fn dump_of(&mut self, frame: FrameName) -> frames::dump::Dump {
        self.answer(Command::Hold);
        self.answer(Command::Show(frame));
        self.dump_page()
    }
}

impl<B: Backend> DynBackend for B {
    fn answer(&mut self, command: Command) -> Vec<String> {
        self.send(command).unwrap()
    }

    fn dump_page(&mut self) -> frames::dump::Dump {
        self.dump(Content::Page).unwrap()
    }
}

#[test]
fn a_damaged_model_file_is_reported_and_the_built_in_scenes_still_work() {
    let mut bytes = model().bytes;
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    let mut vm = boot(bytes, None);
    vm.wait_until_running().unwrap();
    let answer = vm.model_answer().unwrap().to_string();
    assert!(
        answer.starts_with("refused model: the header states checksum "),
        "{answer}"
    );
    let mut memory = backend::memory();
    let mut emulated = EmulatedDemo::new(&mut memory).unwrap();
    let ball = emulated.dump_of(FrameName::Number(480));
    assert_eq!(ball.header.scene, "ball");
    assert_eq!(vm.dump_of(FrameName::Number(480)), ball);
    vm.leave().unwrap();
}
