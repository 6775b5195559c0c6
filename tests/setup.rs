//! The set-up from the outside, good and bad cases, in isolated worlds: a process with its own cache, home,
//! target folder and `PATH`, where small shell scripts stand in for rustup, apt-get, cargo and QEMU. So the
//! tests touch nothing of the user's, a whole set-up lasts a quarter of a second, and failures can be
//! provoked at will.
//!
//! The real steps (packages from the archive, compilers, minutes of building) use the same code. The first
//! `cargo test` on a new machine runs them, and so does `real_set_up_recovers_from_kills`, by hand:
//! `cargo test --test setup -- --ignored real`.

use std::env;
use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use setup::Options;
use system::Interrupted;
use tempfile::TempDir;

/// The variable that names the action of the process of [`in_a_world`].
const DO: &str = "CRYSTAL_BALL_TEST_DO";

/// The tools that the scripts may call.
const TOOLS: [&str; 13] = [
    "sh", "setpriv", "mkdir", "cp", "cat", "sleep", "chmod", "mv", "rm", "date", "touch", "ln",
    "env",
];

/// Writes a complete toolchain, slowly, and its last files at the end.
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

/// Builds the requested target, slowly.
const CARGO: &str = r#"
case $* in
*/boot/image/*)
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
    /// Uses this machine's programs and the user's environment: only the cache and the target are separate.
    real: bool,
}

impl World {
    /// A world where cargo, rustup and QEMU work; apt-get is missing.
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

    /// A world without programs, except this test's program in the target folder, as if it had been built
    /// there.
    fn empty(real: bool) -> Self {
        let world = Self {
            folder: tempfile::tempdir().unwrap(),
            real,
        };
        for folder in ["home", "cache", "target", "tmp"] {
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

    /// Adds an archive with a QEMU, and a system that has one of the libraries that QEMU needs.
    fn debian_with_qemu(&self) {
        let apt = r#"
echo "$*" >>$HOME/apt.log
# The hash of "hello\n".
hash=SHA256:5891b5b522d5df086d0ff0b110fbd9d21bb4fc7163af34d08286a2e846f6be03
offer() { echo "'http://archive/$1.deb' ${1}_1_amd64.deb 6 $2"; }
all=$*
case " $all" in
*" update") echo "'http://archive/debian/dists/bookworm/InRelease' x 0" ;;
*" install "*)
    for name in libsame qemu-data ${all##* install }; do offer $name MD5Sum:00; done ;;
*--print-uris*) for name in ${all##* download }; do offer $name $hash; done ;;
*) for name in ${all##* download }; do echo hello >${name}_1_amd64.deb; done ;;
esac"#;
        let dpkg = r#"
mkdir -p $3/usr/bin $3/usr/lib/x86_64-linux-gnu $3/lib/x86_64-linux-gnu
touch $3/lib/x86_64-linux-gnu/libx.so.1
case $2 in
*gui*) touch $3/usr/bin/window ;;
*x86*) cat >$3/usr/bin/qemu-system-x86_64 <<'END'
#!/bin/sh
[ -e $LD_LIBRARY_PATH/libx.so.1 ] || exit 127
case $1$3$5$7 in
-L-L-L--version) echo "QEMU emulator version 10.0.2 (fake)" ;;
-L-L-L-display) echo types:; [ -e ${0%/*}/window ] && echo gtk; echo none ;;
*) exit 1 ;;
esac
END
    chmod +x $3/usr/bin/qemu-system-x86_64 ;;
esac"#;
        self.program("apt-get", apt);
        self.program("dpkg", dpkg);
        self.program("dpkg-query", "echo 'installed libsame_1_amd64'");
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
            // Not below the user's home, where settings of cargo may be.
            command.current_dir(self.path("home"));
            command
                .env("TMPDIR", self.path("tmp"))
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

    /// Checks that everything is in place, and nothing else.
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
            5,
            "lock, aside, toolchain, image maker, cargo's home"
        );
    }
}

fn write_program(path: &Path, script: &str) {
    // Another process writes the file. A test that starts a program at this moment would inherit the open
    // file, and starting the script would fail ("text file busy").
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

/// The exit code and the messages of a set-up.
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

    /// Checks that it failed with all these words.
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
    system::catch_interrupts();
    let options = Options {
        toolchain: env::var_os("TEST_TOOLCHAIN").map(Into::into),
        window: what == "window",
        ..Options::default()
    };
    let done = match what.as_str() {
        "image" => setup::image(&options).map(|_| true),
        "qemu" | "window" => setup::qemu(&options).map(|qemu| !qemu.version.is_empty()),
        "suite" => setup::qemu_of_suite(&env::var("TEST_SUITE").unwrap()).map(|_| true),
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
    // Slow enough that the second set-up reports that it waits.
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
    ];
    world.does("image").badly(&words);
    world.remove("rustup");
    world
        .does("image")
        .badly(&["install rustup (https://rustup.rs; it needs no administrator), then rustup"]);
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
    // Without its sources the toolchain is incomplete, and the set-up tries the next source.
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

/// Debian without rustup: `answers` is apt-get's script for URIs and downloads.
fn debian(answers: &str) -> World {
    let world = World::new();
    world.remove("rustup");
    world.program("dpkg", "exit 1");
    world.program("dpkg-query", "exit 0");
    let script = format!(
        r#"
echo "$*" >>$HOME/apt.log
offers() {{ # VERSION HASH: an archive that has these
    for word; do case $word in -*|*=*|*/*|download|install|$1|$2) ;;
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
cd $3/usr/lib/llvm-22/bin
for tool in llvm-objcopy llvm-objdump lld; do echo '#!/bin/sh' >$tool; chmod +x $tool; done
printf '#!/bin/sh\n[ -d $LD_LIBRARY_PATH/../rustlib ] || exit 1
echo "host: x86_64-unknown-linux-gnu"; echo "release: 1.96.0"' >$3/usr/bin/rustc; chmod +x $3/usr/bin/rustc"#;
    world.program("dpkg", unpack);
    world
        .does("image")
        .well()
        .saying(&["downloading Rust 1.96.0 as 7 Debian packages"]);
    let apt = || fs::read_to_string(world.path("home/apt.log")).unwrap();
    let asked = apt();
    assert!(!asked.contains("update"), "the system's lists do:\n{asked}");

    // Without the network and without the archive, which drops old versions: uses the kept packages.
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

    // Only a damaged package is fetched again.
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

/// The real cargo reports the settings that it finds where the nested builds run, and where `cargo install`
/// looks for them: in its home and above.
#[test]
fn users_cargo_settings_do_not_reach_the_builds() {
    const HOSTILE: &str = r#"
        [build]
        rustflags = ["-C", "target-cpu=native"]
        target = "x86_64-unknown-linux-gnu"
        rustc-wrapper = "/nowhere/wrapper"
        target-dir = "/nowhere/target"
        [target.x86_64-unknown-none]
        rustflags = ["-C", "link-arg=-fuse-ld=mold"]
        [target.'cfg(all())']
        rustflags = ["-C", "opt-level=0"]
        [profile.release]
        debug = true
        [unstable]
        build-std = ["std"]
        [env]
        RUSTC_LINKER = "mold"
        [net]
        retry = 7
    "#;
    let world = World::new();
    let cargo = format!(
        r#"
config() {{ {} -Zunstable-options config get; }}
{{ config; env; }} >>$HOME/settings.log
case $* in */boot/image/*) (cd $CARGO_HOME/registry; config) >>$HOME/settings.log ;; esac
{CARGO}"#,
        env!("CARGO")
    );
    world.program("cargo", &cargo);
    // Above the clone, which is the current folder; above the cache; and in cargo's home.
    for folder in [".cargo", "home/.cargo"] {
        fs::create_dir(world.path(folder)).unwrap();
        fs::write(world.path(folder).join("config.toml"), HOSTILE).unwrap();
    }
    let hostile = [
        ("CARGO_BUILD_RUSTFLAGS", "-C target-cpu=native"),
        ("CARGO_BUILD_TARGET", "x86_64-unknown-linux-gnu"),
        ("CARGO_ENCODED_RUSTFLAGS", "-Ctarget-cpu=native"),
        ("CARGO_PROFILE_RELEASE_LTO", "off"),
        ("CARGO_TARGET_DIR", "/nowhere/target"),
        ("CARGO_TARGET_X86_64_UNKNOWN_NONE_LINKER", "mold"),
        ("CARGO_UNSTABLE_BUILD_STD", "std"),
        ("RUSTFLAGS", "-C target-cpu=native"),
        ("RUSTC_WRAPPER", "/nowhere/wrapper"),
        ("CARGO_HTTP_TIMEOUT", "5"),
    ];
    let mut run = world.command("image");
    Said::from(run.envs(hostile).output().unwrap()).well();
    world.is_whole();
    let log = fs::read_to_string(world.path("home/settings.log")).unwrap();
    for word in [
        "native",
        "linux-gnu\"",
        "nowhere",
        "mold",
        "opt-level",
        "debug",
        "std",
        "LTO",
    ] {
        assert!(!log.contains(word), "{word} in:\n{log}");
    }
    // The network's settings stay: in the two builds and in one home.
    assert_eq!(log.matches("net.retry = 7").count(), 3, "{log}");
    assert_eq!(log.matches("\nCARGO_HTTP_TIMEOUT=5").count(), 2, "{log}");
}

#[test]
fn missing_qemu_is_unpacked_into_the_cache() {
    let world = World::new();
    world.remove("qemu-system-x86_64");
    world.does("qemu").badly(&[
        "QEMU is needed",
        "this is no Debian system",
        "ask your administrator",
        "sudo apt-get install qemu-system-x86",
        "--qemu PATH",
    ]);
    world
        .does("doctor")
        .badly(&["MISSING QEMU", "package manager"]);
    world.debian_with_qemu();
    world
        .does("doctor")
        .badly(&["the next run unpacks Debian's package qemu-system-x86"]);
    world.does("qemu").well().saying(&[
        "downloading QEMU as 2 Debian packages (12 B), once",
        "unpacking QEMU",
        "QEMU is in ",
    ]);
    assert_eq!(world.does("qemu").well().text, "", "a kept one is used");
    let asked = || fs::read_to_string(world.path("home/apt.log")).unwrap();
    let downloaded = |line: &&str| line.contains(" download ") && line.contains("libsame");
    assert_eq!(asked().lines().find(downloaded), None, "the system has it");
    // The installation is planned and downloaded, but not carried out.
    let installs = |line: &&str| line.contains(" install ") && !line.contains("--print-uris");
    assert_eq!(asked().lines().find(installs), None);

    // QEMU no longer starts, since a library of the system is gone; it is unpacked again.
    write_program(&world.cache("qemu/usr/bin/qemu-system-x86_64"), "exit 127");
    world
        .does("qemu")
        .well()
        .saying(&["the kept QEMU is not used", "unpacking QEMU"]);
    // Without the network, a kept QEMU is good enough.
    let offline = |what| {
        let mut command = world.command(what);
        Said::from(command.env("CARGO_NET_OFFLINE", "1").output().unwrap())
    };
    offline("qemu").well();
    offline("window")
        .well()
        .saying(&["cannot open a window", "offline"]);
    // A QEMU with a window replaces the other.
    world
        .does("window")
        .well()
        .saying(&["downloading QEMU and its window"]);
    assert_eq!(world.does("window").well().text, "");
    assert_eq!(entries(&world.cache("")), 3, "lock, aside, QEMU");
    assert_eq!(entries(&world.cache("aside")), 0);
}

#[test]
fn qemu_of_a_suite_is_beside_the_systems() {
    let world = World::new();
    world.debian_with_qemu();
    let of = |suite: &str| {
        let mut command = world.command("suite");
        Said::from(command.env("TEST_SUITE", suite).output().unwrap())
    };
    of("sid").well().saying(&["unpacking QEMU", "qemu-sid"]);
    assert_eq!(of("sid").well().text, "");
    let asked = fs::read_to_string(world.path("home/apt.log")).unwrap();
    assert!(asked.contains("-t sid"), "{asked}");
    for other in ["", "../x", "-o", "a b"] {
        of(other).badly(&["is not the name of a Debian suite"]);
    }
}

#[test]
fn full_disk_ends_the_search_for_a_compiler() {
    let world = debian("exit 1");
    world.program(
        "rustup",
        "echo 'error: could not write: No space left on device (os error 28)' >&2; exit 1",
    );
    world
        .does("image")
        .badly(&["No space left on device"])
        .not_saying("Debian");
    assert!(!world.path("home/apt.log").exists());
}

#[test]
fn being_without_a_window_is_no_error() {
    let world = World::new();
    world.program("qemu-system-x86_64", &QEMU.replace("gtk", "curses"));
    world
        .does("window")
        .well()
        .saying(&["cannot open a window", "install qemu-system-gui"]);
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

/// Uses the compiler and the builds of this machine: a quarter of an hour. Each run finds what the previous
/// run has finished, so each of these moments is in another step: download, unpacking, boot loader, kernel.
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

/// Kills a set-up at ten moments, each time in a new world; each time the next run must succeed.
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
