//! No subcommand: boot the image and watch.

use std::time::{Duration, Instant};

use crystal_ball::window;
use frames::backend::Backend;
use frames::options::FrameOptions;
use protocol::{Action, Change, Command};
use qemu::{Config, Vm};
use system::{say, write_atomically};

use crate::common::{Common, has_display};
use crate::output::print_path;

/// How long the solid turns before the PNG is written, if no window is open.
const WARM_UP: Duration = Duration::from_secs(1);

/// Boots the image in a window; without a display, or with `--headless`, boots it and writes a PNG.
pub fn run(mut common: Common) -> anyhow::Result<()> {
    let model = common.load_to_boot()?;
    let headless = common.headless;
    common.options.window = !headless && has_display();
    let ready = setup::ready(&common.options)?;
    let config = common.config(&ready, model.as_ref());
    let frame_options = &common.frame_options;
    let displays = &ready.qemu.displays;
    // Only with this option does GTK scale the frame to the window's size.
    let display = [("gtk", "gtk,zoom-to-fit=on"), ("sdl", "sdl")]
        .into_iter()
        .find(|(name, _)| displays.iter().any(|display| display == name))
        .filter(|_| common.options.window)
        .map(|(_, display)| display);
    if display.is_none() && !headless {
        let why = if has_display() {
            "this QEMU cannot open a window; on Debian, install the package qemu-system-gui"
        } else {
            "no display: neither DISPLAY nor WAYLAND_DISPLAY is set"
        };
        say(format_args!("{why}; booting without a window"));
    }
    let name = png_name(frame_options, config.model_file);
    let start = Instant::now();
    say(format_args!("booting in QEMU {}", ready.qemu.version));
    let mut vm = Vm::boot(&Config {
        display: display.unwrap_or("none").to_string(),
        ..config
    })?;
    vm.wait_until_running()?;
    if display.is_some() {
        // SDL resizes its window to the VGA's mode only when QEMU reads the screen, so read it now.
        vm.screen()?;
        // If the window cannot be enlarged, it stays as small as QEMU made it.
        let _ = window::enlarge(vm.process());
    }
    for command in frame_options.commands() {
        vm.send(command)?;
    }
    let seconds = start.elapsed().as_secs_f64();
    say(format_args!(
        "the first frame is on the screen {seconds:.1} s after the start"
    ));
    if display.is_some() {
        vm.send(Command::Steer(None, Change::Act(Action::Hint)))?;
        say("press H in the window to see the keys; close it or press Ctrl-C to end the run");
        return vm.watch();
    }
    vm.rest(WARM_UP)?;
    let png = setup::folder().join(name);
    let screen = vm.screen()?;
    write_atomically(&png, |file| screen.write_png(file))?;
    vm.leave()?;
    say("a frame of the running demo:");
    Ok(print_path(&png)?)
}

/// Returns the name of a run's PNG. Two runs at once that show different things write different files.
fn png_name(frame_options: &FrameOptions, model_file: Option<u32>) -> String {
    let mut name = String::from("frame");
    for command in frame_options.commands() {
        if let Command::Set(_, Some(word)) = command {
            // A tolerance is a fraction.
            name += &format!("-{word}").replace('/', "_");
        }
    }
    name.extend(model_file.map(|model_file| format!("-{model_file:08x}")));
    name + ".png"
}
