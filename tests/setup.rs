//! The set-up from the outside, good and bad cases, in worlds of our own: a process with its own cache, home,
//! target folder and `PATH`, where small shell scripts stand in for rustup, apt-get, cargo and QEMU. So nothing
//! of the user's is touched, a whole set-up takes a quarter of a second, and failures can be had at will.
//!
//! The real ways (packages from the archive, compilers, minutes of building) are the same code: the first
//! `cargo test` on a new machine goes them, and `real_set_up_recovers_from_kills`, by hand:
//! `cargo test --test setup -- --ignored real`.

use std::env;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crystal_ball::child::{self, Interrupted};
use crystal_ball::setup::{self, Options};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use tempfile::TempDir;

/// Names what the process of [`in_a_world`] shall do.
const DO: &str = "CRYSTAL_BALL_TEST_DO";

/// What the scripts may call, beside each other.
const TOOLS: [&str; 12] = [
    "sh", "setpriv", "mkdir", "cp", "cat", "sleep", "chmod", "mv", "rm", "date", "touch", "ln",
];

/// Writes a complete toolchain, slowly, and with its end last.
const TOOLCHAIN: &str = r#"
toolchain() {
    tools=$1/lib/rustlib/x86_64-unknown-linux-gnu/bin
    core=$1/lib/rustlib/src/rust/library/core/src
    mkdir -p $1/bin $tools $core
    printf '#!/bin/sh\necho "host: x86_64-unknown-linux-gnu"; echo "release: 1.96.0"\n' >$1/bin/rustc
    chmod +x $1/bin/rustc; sleep 0.03
    touch $tools/llvm-objcopy $tools/llvm-objdump; sleep 0.03
    touch $tools/rust-lld $core/lib.rs
}
"#;

const RUSTUP: &str = r#"
[ $1 = toolchain ] || exit 1
echo got >>$HOME/rustup.log
toolchain $RUSTUP_HOME/toolchains/1.96.0-x86_64-unknown-linux-gnu
"#;

/// Builds whatever is asked for, slowly.
const CARGO: &str = r#"
case $PWD in
*/boot/image)
    while [ $1 != --target-dir ]; do shift; done
    echo "   Compiling bootloader" >&2
    mkdir -p $2/debug; sleep 0.03
    printf '#!/bin/sh\nsleep 0.01; cat "$1" >"$2"; sleep 0.01; echo " in an image" >>"$2"\n' >$2/debug/crystal-ball-image
    sleep 0.03; chmod +x $2/debug/crystal-ball-image ;;
*)
    while [ $1 != --target-dir ]; do shift; done
    mkdir -p $2/x86_64-unknown-none/release; sleep 0.03
    echo "the kernel" >$2/x86_64-unknown-none/release/crystal-ball-kernel ;;
esac
echo "    Finished \`release\` profile" >&2
"#;

const QEMU: &str = r#"
case $1 in
--version) echo "QEMU emulator version 7.2.0 (fake)" ;;
-display) printf 'Available display backend types:\nnone\ngtk\n' ;;
esac
"#;

/// A place where a set-up can run and change nothing else.
struct World {
    folder: TempDir,
    /// With this machine's programs and the user's environment: only the cache and the target are apart.
    real: bool,
}

impl World {
    /// Cargo, rustup and QEMU work; there is no apt-get.
    fn new() -> Self {
        let world = Self::empty(false);
        fs::create_dir(world.path("bin")).unwrap();
        let path = env::var_os("PATH").unwrap();
        for tool in TOOLS {
            let mut places = env::split_paths(&path).map(|folder| folder.join(tool));
            let real = places.find(|place| place.exists()).unwrap();
            symlink(real, world.path("bin").join(tool)).unwrap();
        }
        world.program("rustup", &format!("{TOOLCHAIN}{RUSTUP}"));
        world.program("cargo", CARGO);
        world.program("qemu-system-x86_64", QEMU);
        world
    }

    /// No programs; this test's own program, as if it had been built in the world's target folder.
    fn empty(real: bool) -> Self {
        let world = Self {
            folder: tempfile::tempdir().unwrap(),
            real,
        };
        for folder in ["home", "cache", "target"] {
            fs::create_dir(world.path(folder)).unwrap();
        }
        fs::write(world.path("target/.rustc_info.json"), "").unwrap();
        fs::copy(env::current_exe().unwrap(), world.path("target/setup")).unwrap();
        world
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn cache(&self, name: &str) -> PathBuf {
        self.path("cache/crystal-ball").join(name)
    }

    fn image(&self) -> PathBuf {
        self.path("target/crystal-ball/crystal-ball.img")
    }

    fn program(&self, name: &str, script: &str) {
        write_program(&self.path("bin").join(name), script);
    }

    fn remove(&self, program: &str) {
        fs::remove_file(self.path("bin").join(program)).unwrap();
    }

    /// A command that does `what` in this world.
    fn command(&self, what: &str) -> Command {
        let mut command = Command::new(self.path("target/setup"));
        command.args(["--exact", "in_a_world", "--ignored", "--nocapture"]);
        if !self.real {
            command.env_clear().env("HOME", self.path("home"));
            // Not below the user's home, where cargo's settings may be.
            command.current_dir(self.path("home"));
            command
                .env("PATH", self.path("bin"))
                .env("CARGO", self.path("bin/cargo"));
        }
        command
            .env(DO, what)
            .env("XDG_CACHE_HOME", self.path("cache"));
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        command
    }

    fn does(&self, what: &str) -> Said {
        Said::from(self.command(what).output().unwrap())
    }

    /// Everything is in place, and nothing beside it.
    fn is_whole(&self) {
        assert_eq!(
            fs::read_to_string(self.image()).unwrap(),
            "the kernel\n in an image\n"
        );
        assert!(
            self.cache("toolchain-1.96.0/lib/rustlib/src/rust/library/core/src/lib.rs")
                .exists()
        );
        assert_eq!(entries(&self.cache("aside")), 0, "something is left aside");
        assert_eq!(
            entries(&self.cache("")),
            4,
            "lock, aside, toolchain, image maker"
        );
    }
}

fn write_program(path: &Path, script: &str) {
    // Written by another process: a test that starts a program at this moment would inherit an open file, and
    // starting the script would fail ("text file busy").
    let mut copy = Command::new("sh");
    copy.args([
        "-c",
        r#"printf '%s' "$2" >"$1.new" && chmod +x "$1.new" && mv "$1.new" "$1""#,
        "sh",
    ]);
    assert!(
        copy.arg(path)
            .arg(format!("#!/bin/sh\n{script}"))
            .status()
            .unwrap()
            .success()
    );
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

/// How a set-up ended, and its words.
#[derive(Debug)]
struct Said {
    code: Option<i32>,
    text: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            text: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Said {
    #[track_caller]
    fn well(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.text);
        self
    }

    /// It failed, with all these words.
    #[track_caller]
    fn badly(self, words: &[&str]) -> Self {
        assert_eq!(self.code, Some(1), "{}", self.text);
        self.saying(words)
    }

    #[track_caller]
    fn saying(self, words: &[&str]) -> Self {
        for word in words {
            assert!(self.text.contains(word), "no {word:?} in:\n{}", self.text);
        }
        self
    }

    #[track_caller]
    fn not_saying(self, word: &str) -> Self {
        assert!(!self.text.contains(word), "{word:?} in:\n{}", self.text);
        self
    }
}

/// Not a test: the process that the tests start in their worlds.
#[test]
#[ignore = "started by the other tests"]
fn in_a_world() {
    let Ok(what) = env::var(DO) else { return };
    child::catch_interrupts();
    let options = Options {
        toolchain: env::var_os("TEST_TOOLCHAIN").map(Into::into),
        window: what == "window",
        ..Options::default()
    };
    let done = match what.as_str() {
        "image" => setup::image(&options).map(|_| true),
        "doctor" => setup::doctor(&options, &mut std::io::stderr()),
        "clean" => setup::clean(&mut std::io::stderr()).map(|_| true),
        _ => setup::ready(&options).map(|ready| !ready.qemu.version.is_empty()),
    };
    let code = match done {
        Ok(good) => i32::from(!good),
        Err(error) if error.is::<Interrupted>() => Interrupted::EXIT_CODE,
        Err(error) => {
            writeln!(std::io::stderr(), "{error:#}").unwrap();
            1
        }
    };
    std::process::exit(code);
}

#[test]
fn first_run_makes_all_and_second_run_nothing() {
    let world = World::new();
    world.does("doctor").badly(&["MISSING toolchain"]);
    assert!(!world.cache("").exists(), "looking changes nothing");
    world
        .does("ready")
        .well()
        .saying(&["getting Rust 1.96.0", "building the boot loader"]);
    world.is_whole();
    world
        .does("doctor")
        .well()
        .saying(&["Rust 1.96.0", "QEMU", "7.2.0 (fake)"])
        .not_saying("MISSING");
    let kernel = fs::metadata(world.path("target/kernel"))
        .unwrap()
        .modified()
        .unwrap();
    assert_eq!(world.does("ready").well().text, "", "a warm run is silent");
    assert_eq!(
        fs::read_to_string(world.path("home/rustup.log")).unwrap(),
        "got\n"
    );
    assert_eq!(
        fs::metadata(world.path("target/kernel"))
            .unwrap()
            .modified()
            .unwrap(),
        kernel
    );
}

#[test]
fn clean_removes_all_and_says_how_much() {
    let world = World::new();
    world.does("ready").well();
    world
        .does("clean")
        .well()
        .saying(&["toolchain-1.96.0", "freed"]);
    assert_eq!(entries(&world.cache("")), 1, "only the lock stays");
    assert!(!world.image().exists());
    world.does("ready").well();
    world.is_whole();
}

#[test]
fn damaged_cache_is_made_again() {
    let world = World::new();
    world.does("ready").well();
    let broken: [fn(&World); 3] = [
        |world| {
            fs::remove_file(
                world.cache("toolchain-1.96.0/lib/rustlib/src/rust/library/core/src/lib.rs"),
            )
            .unwrap()
        },
        |world| {
            write_program(
                &world.cache("toolchain-1.96.0/bin/rustc"),
                "echo 'host: x86_64-unknown-linux-gnu'; echo 'release: 1.95.0'",
            )
        },
        |world| {
            for entry in fs::read_dir(world.cache(""))
                .unwrap()
                .map(|entry| entry.unwrap().path())
            {
                if entry.join("sha256").exists() {
                    fs::write(entry.join("crystal-ball-image"), "half a prog").unwrap();
                }
            }
        },
    ];
    for breaks in broken {
        breaks(&world);
        world.does("ready").well();
        world.is_whole();
    }
}

#[test]
fn set_ups_wait_for_each_other() {
    let world = World::new();
    // Slow enough that the second one says that it waits.
    world.program("cargo", &format!("sleep 1\n{CARGO}"));
    let both: Vec<_> = (0..2)
        .map(|_| world.command("ready").spawn().unwrap())
        .collect();
    let said: Vec<_> = both
        .into_iter()
        .map(|child| Said::from(child.wait_with_output().unwrap()))
        .collect();
    assert_eq!(
        said.iter()
            .filter(|said| said.text.contains("waiting for another set-up"))
            .count(),
        1
    );
    said.into_iter().for_each(|said| drop(said.well()));
    assert_eq!(
        fs::read_to_string(world.path("home/rustup.log")).unwrap(),
        "got\n"
    );
    world.is_whole();
}

#[test]
fn nothing_is_fetched_when_cargo_is_offline() {
    let world = World::new();
    let offline = world
        .command("image")
        .env("CARGO_NET_OFFLINE", "true")
        .output()
        .unwrap();
    Said::from(offline).badly(&["offline (CARGO_NET_OFFLINE)"]);
    let settings = world.path("home/.cargo");
    fs::create_dir(&settings).unwrap();
    fs::write(settings.join("config.toml"), "[net]\noffline = true\n").unwrap();
    world.does("image").badly(&["offline (net.offline in "]);
    world
        .does("doctor")
        .badly(&["not used (net.offline in ", ".cargo/config.toml)"]);
    assert!(!world.path("home/rustup.log").exists());
    fs::remove_dir_all(settings).unwrap();
    world.does("image").well();
    let offline = world
        .command("image")
        .env("CARGO_NET_OFFLINE", "true")
        .output()
        .unwrap();
    Said::from(offline).well();
}

#[test]
fn no_way_to_a_compiler_is_one_message() {
    let world = World::new();
    world.program(
        "rustup",
        "echo 'error: could not download: no network' >&2; exit 1",
    );
    let words = [
        "- rustup: ",
        "could not download: no network",
        "- Debian's packages: this is no Debian system",
        "rustup toolchain install 1.96.0",
        "--toolchain DIR",
        "on no other system",
    ];
    world.does("image").badly(&words);
    assert_eq!(entries(&world.cache("aside")), 0);
}

#[test]
fn toolchains_of_the_users_choice_must_be_complete() {
    let world = World::new();
    let chosen = world.path("mine");
    let with = |variable: &str| {
        Said::from(
            world
                .command("image")
                .env(variable, &chosen)
                .output()
                .unwrap(),
        )
    };
    with("TEST_TOOLCHAIN").badly(&["mine is not a complete toolchain"]);
    fs::create_dir_all(chosen.join("bin")).unwrap();
    with("CRYSTAL_BALL_TOOLCHAIN").badly(&["it has no bin/rustc"]);
    write_program(
        &chosen.join("bin/rustc"),
        "echo 'host: x86_64-unknown-linux-gnu'; echo 'release: 1.97.1'",
    );
    let missing = [
        "library/core/src/lib.rs",
        "bin/llvm-objcopy",
        "bin/llvm-objdump",
        "bin/rust-lld",
    ];
    with("TEST_TOOLCHAIN")
        .badly(&missing)
        .not_saying("it has no bin/rustc");
    write_program(&world.path("make"), &format!("{TOOLCHAIN}\ntoolchain $1"));
    assert!(
        Command::new(world.path("make"))
            .arg(&chosen)
            .status()
            .unwrap()
            .success()
    );
    with("TEST_TOOLCHAIN").well();
    assert!(!world.cache("toolchain-1.96.0").exists());
}

#[test]
fn users_own_rustup_toolchain_is_used_in_place() {
    let world = World::new();
    let which = r#"
if [ $1 = which ]; then [ $RUSTUP_AUTO_INSTALL = 0 ] && echo $HOME/own/bin/rustc; exit; fi
echo got >>$HOME/rustup.log; exit 1"#;
    world.program(
        "rustup",
        &format!("{TOOLCHAIN}\n[ -d $HOME/own ] || toolchain $HOME/own{which}"),
    );
    world.does("image").well();
    assert!(!world.cache("toolchain-1.96.0").exists());
    assert!(!world.path("home/rustup.log").exists());
    // Without its sources it is not complete, and something else is tried.
    fs::remove_dir_all(world.path("home/own/lib/rustlib/src")).unwrap();
    world.does("image").badly(&["- rustup: "]);
    assert!(world.path("home/rustup.log").exists());
}

#[test]
fn cache_that_cannot_be_written_is_named() {
    let world = World::new();
    fs::write(world.path("file"), "").unwrap();
    let run = world
        .command("image")
        .env("XDG_CACHE_HOME", world.path("file"))
        .output()
        .unwrap();
    Said::from(run).badly(&["file/crystal-ball cannot be used", "XDG_CACHE_HOME"]);
}

/// Debian without rustup: `answers` is what apt-get does when asked for URIs, or to download.
fn debian(answers: &str) -> World {
    let world = World::new();
    world.remove("rustup");
    world.program("dpkg", "exit 1");
    let script = format!(
        r#"
echo "$*" >>$HOME/apt.log
offers() {{ # VERSION HASH: an archive that has these
    for word; do case $word in -*|*=*|download|$1|$2) ;;
    *rust*) echo "'http://archive/$word.deb' ${{word}}_$1_all.deb 5 SHA256:$2" ;;
    *) echo "'http://archive/$word.deb' ${{word}}_22_all.deb 5 SHA256:$2" ;;
    esac; done
}}
case "$*" in
*update*) exit 0 ;;
*) {answers} ;;
esac"#
    );
    world.program("apt-get", &script);
    world
}

#[test]
fn archive_with_another_version_is_named() {
    let world = debian(r#"offers 1.97.0+dfsg1-1 00 "$@""#);
    world.does("image").badly(&[
        "rustc-web 1.97.0+dfsg1-1",
        "pinned to 1.96.0",
        "--toolchain DIR",
    ]);
    let asked = fs::read_to_string(world.path("home/apt.log")).unwrap();
    assert!(
        asked.contains("Dir::State::lists"),
        "newer lists are tried first, in a place of our own:\n{asked}"
    );
}

#[test]
fn download_that_changed_on_its_way_is_refused() {
    let answers = r#"
    case "$*" in
    *print-uris*) offers 1.96.0+dfsg1-1 00 "$@" ;;
    *) for word; do echo hello >${word}_1.96.0+dfsg1-1_all.deb; done ;;
    esac"#;
    let world = debian(answers);
    world
        .does("image")
        .badly(&["was cut short or changed on its way", "SHA-256"]);
    assert_eq!(
        entries(&world.cache("packages-1.96.0")),
        0,
        "nothing of it is kept"
    );
}

#[test]
fn debian_packages_make_the_toolchain_and_are_kept() {
    let answers = r#"
    hash=5891b5b522d5df086d0ff0b110fbd9d21bb4fc7163af34d08286a2e846f6be03
    case "$*" in
    *print-uris*) offers 1.96.0+dfsg1-1 $hash "$@" ;;
    *) for word; do case $word in *rust*) echo hello >${word}_1.96.0+dfsg1-1_all.deb ;;
       *) echo hello >${word}_22_all.deb ;; esac; done ;;
    esac"#;
    let world = debian(answers);
    let unpack = r#"
mkdir -p $3/usr/bin $3/usr/lib/x86_64-linux-gnu $3/usr/lib/llvm-22/bin $3/usr/lib/rustlib/src/rust/library/core/src
touch $3/usr/lib/rustlib/src/rust/library/core/src/lib.rs
cd $3/usr/lib/llvm-22/bin; touch llvm-objcopy llvm-objdump lld
printf '#!/bin/sh\n[ -d $LD_LIBRARY_PATH/../rustlib ] || exit 1
echo "host: x86_64-unknown-linux-gnu"; echo "release: 1.96.0"' >$3/usr/bin/rustc; chmod +x $3/usr/bin/rustc"#;
    world.program("dpkg", unpack);
    world
        .does("image")
        .well()
        .saying(&["downloading Rust 1.96.0 as Debian packages"]);
    let apt = || fs::read_to_string(world.path("home/apt.log")).unwrap();
    let asked = apt();
    assert!(!asked.contains("update"), "the system's lists do:\n{asked}");

    // Without the network, and without the archive, which drops old versions: from the packages kept.
    fs::remove_dir_all(world.cache("toolchain-1.96.0")).unwrap();
    let offline = || {
        Said::from(
            world
                .command("image")
                .env("CARGO_NET_OFFLINE", "1")
                .output()
                .unwrap(),
        )
    };
    offline().well().not_saying("downloading");
    assert_eq!(apt(), asked);

    // A damaged one is fetched again, it alone.
    let damaged = "lld-22_22_all.deb";
    fs::write(world.cache("packages-1.96.0").join(damaged), "hell").unwrap();
    fs::remove_dir_all(world.cache("toolchain-1.96.0")).unwrap();
    offline().badly(&["offline"]);
    world.does("image").well();
    let last = apt().lines().last().unwrap().to_owned();
    assert!(last.ends_with(" download lld-22"), "{last}");
}

#[test]
fn failing_download_keeps_what_is_whole() {
    // The hash of "hello\n"; the disk is full after the first package.
    let answers = r#"
    hash=5891b5b522d5df086d0ff0b110fbd9d21bb4fc7163af34d08286a2e846f6be03
    case "$*" in
    *print-uris*) offers 1.96.0+dfsg1-1 $hash "$@" ;;
    *) echo hello >rustc-web_1.96.0+dfsg1-1_all.deb
       echo "E: write (28: No space left on device)" >&2; exit 100 ;;
    esac"#;
    let world = debian(answers);
    world
        .does("image")
        .badly(&["No space left on device", "apt-get"]);
    assert_eq!(entries(&world.cache("packages-1.96.0")), 1);
    assert_eq!(entries(&world.cache("aside")), 0);
}

#[test]
fn missing_qemu_is_installed_in_the_open_or_asked_for() {
    let world = World::new();
    world.remove("qemu-system-x86_64");
    world
        .does("ready")
        .badly(&["package manager", "--qemu PATH"]);
    let apt = format!(
        "echo \"$*\" >>$HOME/apt.log\ncase \"$*\" in *install*) cat >${{0%/*}}/qemu-system-x86_64 <<'END'\n#!/bin/sh\n{QEMU}\nEND\nchmod +x ${{0%/*}}/qemu-system-x86_64 ;; esac"
    );
    world.program("apt-get", &apt);
    let said = world.does("ready");
    let root = Command::new("id").arg("-u").output().unwrap().stdout == b"0\n";
    if root {
        said.well()
            .saying(&["installing Debian's package qemu-system-x86 on this system"]);
        world.program("apt-get", "echo 'E: broken' >&2; exit 100");
        world.remove("qemu-system-x86_64");
        world.does("ready").badly(&[
            "E: broken",
            "apt-get install --no-install-recommends qemu-system-x86",
        ]);
    } else {
        said.badly(&[
            "sudo apt-get update && sudo apt-get install --no-install-recommends qemu-system-x86",
        ]);
        assert!(!world.path("home/apt.log").exists());
    }
}

#[test]
fn question_is_ended_by_the_first_interrupt() {
    let world = World::new();
    world.remove("qemu-system-x86_64");
    for program in ["apt-get", "sudo"] {
        world.program(program, "exit 1");
    }
    let user = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&user).unwrap();
    unlockpt(&user).unwrap();
    let terminal = ptsname(&user, Vec::new()).unwrap();
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let terminal = rustix::fs::open(terminal, flags, Mode::empty()).unwrap();
    let mut child = world
        .command("ready")
        .stdin(terminal.try_clone().unwrap())
        .stderr(terminal)
        .spawn()
        .unwrap();
    let mut user = File::from(user);
    let mut text = Vec::new();
    while !text.ends_with(b"[y/N]\r\n") {
        let mut byte = [0];
        user.read_exact(&mut byte).unwrap();
        text.extend(byte);
    }
    // By now it waits for the answer, or will within a moment: either must do.
    signal(&child, "INT");
    wait_for(|| child.try_wait().unwrap().is_some());
    let ended = child.wait().unwrap();
    assert_eq!(ended.code(), Some(Interrupted::EXIT_CODE));
}

#[test]
fn being_without_a_window_is_no_error() {
    let world = World::new();
    world.program("qemu-system-x86_64", &QEMU.replace("gtk", "curses"));
    world
        .does("window")
        .well()
        .saying(&["cannot open a window", "qemu-system-gui"]);
    world.does("ready").well().not_saying("window");
}

#[test]
fn interrupted_set_up_leaves_nothing_aside() {
    let world = World::new();
    world.program("cargo", "echo working >&2; sleep 60");
    let child = world.command("image").spawn().unwrap();
    wait_for(|| {
        world.cache("aside").exists()
            && entries(&world.cache("aside")) > 0
            && world.cache("toolchain-1.96.0").exists()
    });
    signal(&child, "TERM");
    let said = Said::from(child.wait_with_output().unwrap());
    assert_eq!(said.code, Some(Interrupted::EXIT_CODE), "{}", said.text);
    assert_eq!(entries(&world.cache("aside")), 0);
}

#[test]
fn children_and_their_children_die_with_the_set_up() {
    for signal_name in ["KILL", "TERM"] {
        let world = World::new();
        let beat = world.path("beat");
        let beats = || fs::metadata(&beat).map_or(0, |data| data.len());
        let script = format!(
            "sh -c 'while :; do echo >>{}; sleep 0.02; done' & wait",
            beat.display()
        );
        world.program("cargo", &script);
        let mut child = world.command("image").spawn().unwrap();
        wait_for(|| beats() > 3);
        signal(&child, signal_name);
        child.wait().unwrap();
        sleep(Duration::from_millis(200));
        let then = beats();
        sleep(Duration::from_millis(200));
        assert_eq!(beats(), then, "a grandchild lives on after {signal_name}");
    }
}

/// With the compiler and the builds of this machine: a quarter of an hour. What one run has finished the next
/// one finds, so each of these moments is in another step: download, unpacking, boot loader, kernel.
#[test]
#[ignore = "downloads the compiler and builds the boot loader, several times"]
fn real_set_up_recovers_from_kills() {
    let world = World::empty(true);
    for seconds in [1, 2, 4, 8, 12, 16, 30, 60, 100, 150] {
        let mut child = world
            .command("image")
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap();
        sleep(Duration::from_secs(seconds));
        child.kill().unwrap();
        let killed = child.wait().unwrap().signal();
        writeln!(std::io::stderr(), "*** after {seconds} s: {killed:?}").unwrap();
    }
    world.does("image").well();
    assert!(fs::metadata(world.image()).unwrap().len() > 1_000_000);
    assert_eq!(entries(&world.cache("aside")), 0);
}

/// Kills a set-up at ten moments of its life, each time in a new world; each time the next run must end well.
#[test]
fn set_up_recovers_from_kills() {
    let reference = World::new();
    let begun = Instant::now();
    reference.does("image").well();
    let length = begun.elapsed();
    for moment in 1..=10 {
        let world = World::new();
        let mut child = world
            .command("image")
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(length * moment / 11);
        child.kill().unwrap();
        child.wait().unwrap();
        world.does("image").well();
        world.is_whole();
    }
}

fn signal(child: &Child, name: &str) {
    let kill = format!("kill -{name} {}", child.id());
    assert!(
        Command::new("sh")
            .args(["-c", &kill])
            .status()
            .unwrap()
            .success()
    );
}

#[track_caller]
fn wait_for(mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < Duration::from_secs(20), "waited too long");
        sleep(Duration::from_millis(5));
    }
}
