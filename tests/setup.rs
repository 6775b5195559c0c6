//! The set-up from the outside, in sandboxes, with success and failure. A sandbox is a process with a
//! separate cache, home, target folder and `PATH`, where small shell scripts replace rustup, apt-get, cargo
//! and QEMU. So the tests do not touch the user's files, a complete set-up lasts a quarter of a second, and a
//! test can provoke any failure.
//!
//! The real steps (packages from the archive, compilers, minutes of building) use the same code. The first
//! `cargo test` on a new machine runs them, and so does `a_real_set_up_continues_after_a_kill`, by hand:
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

/// The variable that names the action of the process of [`in_a_sandbox`].
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

/// A folder in which a set-up can run without a change to anything else.
struct Sandbox {
    folder: TempDir,
    /// Uses this machine's programs and the user's environment: only the cache and the target are separate.
    real: bool,
}

impl Sandbox {
    /// Returns a sandbox where cargo, rustup and QEMU work; apt-get is missing.
    fn new() -> Self {
        let sandbox = Self::empty(false);
        fs::create_dir(sandbox.path("bin")).unwrap();
        let path = env::var_os("PATH").unwrap();
        for tool in TOOLS {
            let mut places = env::split_paths(&path).map(|folder| folder.join(tool));
            let real = places.find(|place| place.exists()).unwrap();
            symlink(real, sandbox.path("bin").join(tool)).unwrap();
        }
        sandbox.program("rustup", &format!("{TOOLCHAIN}{RUSTUP}"));
        sandbox.program("cargo", CARGO);
        sandbox.program("qemu-system-x86_64", QEMU);
        sandbox
    }

    /// Returns a sandbox without programs, except this test's program in the target folder, as if it had been
    /// built there.
    fn empty(real: bool) -> Self {
        let sandbox = Self {
            folder: tempfile::tempdir().unwrap(),
            real,
        };
        for folder in ["home", "cache", "target", "tmp"] {
            fs::create_dir(sandbox.path(folder)).unwrap();
        }
        fs::write(sandbox.path("target/.rustc_info.json"), "").unwrap();
        fs::copy(env::current_exe().unwrap(), sandbox.path("target/setup")).unwrap();
        sandbox
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

    /// Returns a command that does `what` in this sandbox.
    fn command(&self, what: &str) -> Command {
        let mut command = Command::new(self.path("target/setup"));
        command.args(["--exact", "in_a_sandbox", "--ignored", "--nocapture"]);
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

    fn run(&self, what: &str) -> Outcome {
        Outcome::from(self.command(what).output().unwrap())
    }

    /// Checks that everything is in place, and nothing else.
    fn assert_complete(&self) {
        assert_eq!(
            fs::read_to_string(self.image()).unwrap(),
            "the kernel\n in an image\n"
        );
        assert!(
            self.cache("toolchain-1.96.0/lib/rustlib/src/rust/library/core/src/lib.rs")
                .exists()
        );
        assert_eq!(
            entries(&self.cache("temporary")),
            0,
            "a temporary folder is left"
        );
        assert_eq!(
            entries(&self.cache("")),
            5,
            "lock, temporary folders, toolchain, image maker, cargo's home"
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
struct Outcome {
    code: Option<i32>,
    text: String,
}

impl From<Output> for Outcome {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            text: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Outcome {
    #[track_caller]
    fn succeeded(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.text);
        self
    }

    /// Checks that the set-up failed and that its messages contain all these texts.
    #[track_caller]
    fn failed(self, texts: &[&str]) -> Self {
        assert_eq!(self.code, Some(1), "{}", self.text);
        self.with_text(texts)
    }

    #[track_caller]
    fn with_text(self, texts: &[&str]) -> Self {
        for text in texts {
            assert!(self.text.contains(text), "no {text:?} in:\n{}", self.text);
        }
        self
    }

    #[track_caller]
    fn without_text(self, text: &str) -> Self {
        assert!(!self.text.contains(text), "{text:?} in:\n{}", self.text);
        self
    }
}

/// Not a test: the process that the tests start in their sandboxes.
#[test]
#[ignore = "started by the other tests"]
fn in_a_sandbox() {
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
fn the_first_run_builds_everything_and_the_second_run_nothing() {
    let sandbox = Sandbox::new();
    sandbox.run("doctor").failed(&["MISSING toolchain"]);
    assert!(!sandbox.cache("").exists(), "looking changes nothing");
    sandbox.run("ready").succeeded().with_text(&[
        "downloading Rust 1.96.0 with rustup",
        "building the boot loader",
    ]);
    sandbox.assert_complete();
    sandbox
        .run("doctor")
        .succeeded()
        .with_text(&["Rust 1.96.0", "QEMU", "7.2.0 (fake)"])
        .without_text("MISSING");
    let kernel = fs::metadata(sandbox.path("target/kernel"))
        .unwrap()
        .modified()
        .unwrap();
    assert_eq!(
        sandbox.run("ready").succeeded().text,
        "",
        "a warm run is silent"
    );
    assert_eq!(
        fs::read_to_string(sandbox.path("home/rustup.log")).unwrap(),
        "got\n"
    );
    assert_eq!(
        fs::metadata(sandbox.path("target/kernel"))
            .unwrap()
            .modified()
            .unwrap(),
        kernel
    );
}

#[test]
fn clean_removes_everything_and_reports_the_bytes_freed() {
    let sandbox = Sandbox::new();
    sandbox.run("ready").succeeded();
    sandbox
        .run("clean")
        .succeeded()
        .with_text(&["toolchain-1.96.0", "freed"]);
    assert_eq!(entries(&sandbox.cache("")), 1, "only the lock stays");
    assert!(!sandbox.image().exists());
    sandbox.run("ready").succeeded();
    sandbox.assert_complete();
}

#[test]
fn damaged_cache_entries_are_rebuilt() {
    let sandbox = Sandbox::new();
    sandbox.run("ready").succeeded();
    let broken: [fn(&Sandbox); 3] = [
        |sandbox| {
            fs::remove_file(
                sandbox.cache("toolchain-1.96.0/lib/rustlib/src/rust/library/core/src/lib.rs"),
            )
            .unwrap()
        },
        |sandbox| {
            write_program(
                &sandbox.cache("toolchain-1.96.0/bin/rustc"),
                "echo 'host: x86_64-unknown-linux-gnu'; echo 'release: 1.95.0'",
            )
        },
        |sandbox| {
            for entry in fs::read_dir(sandbox.cache(""))
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
        breaks(&sandbox);
        sandbox.run("ready").succeeded();
        sandbox.assert_complete();
    }
}

#[test]
fn two_set_ups_wait_for_each_other() {
    let sandbox = Sandbox::new();
    // Slow enough that the second set-up reports that it waits.
    sandbox.program("cargo", &format!("sleep 1\n{CARGO}"));
    let both: Vec<_> = (0..2)
        .map(|_| sandbox.command("ready").spawn().unwrap())
        .collect();
    let outcome: Vec<_> = both
        .into_iter()
        .map(|child| Outcome::from(child.wait_with_output().unwrap()))
        .collect();
    assert_eq!(
        outcome
            .iter()
            .filter(|outcome| outcome.text.contains("waiting for another set-up"))
            .count(),
        1
    );
    outcome
        .into_iter()
        .for_each(|outcome| drop(outcome.succeeded()));
    assert_eq!(
        fs::read_to_string(sandbox.path("home/rustup.log")).unwrap(),
        "got\n"
    );
    sandbox.assert_complete();
}

#[test]
fn nothing_is_downloaded_when_cargo_is_offline() {
    let sandbox = Sandbox::new();
    let offline = sandbox
        .command("image")
        .env("CARGO_NET_OFFLINE", "true")
        .output()
        .unwrap();
    Outcome::from(offline).failed(&["offline (CARGO_NET_OFFLINE)"]);
    let settings = sandbox.path("home/.cargo");
    fs::create_dir(&settings).unwrap();
    fs::write(settings.join("config.toml"), "[net]\noffline = true\n").unwrap();
    sandbox.run("image").failed(&["offline (net.offline in "]);
    sandbox
        .run("doctor")
        .failed(&["not used (net.offline in ", ".cargo/config.toml)"]);
    assert!(!sandbox.path("home/rustup.log").exists());
    fs::remove_dir_all(settings).unwrap();
    sandbox.run("image").succeeded();
    let offline = sandbox
        .command("image")
        .env("CARGO_NET_OFFLINE", "true")
        .output()
        .unwrap();
    Outcome::from(offline).succeeded();
}

#[test]
fn the_message_about_a_missing_compiler_names_every_failed_source_and_every_remedy() {
    let sandbox = Sandbox::new();
    sandbox.program(
        "rustup",
        "echo 'error: could not download: no network' >&2; exit 1",
    );
    let texts = [
        "- rustup: ",
        "could not download: no network",
        "- Debian's packages: this is not a Debian system",
        "rustup toolchain install 1.96.0",
        "--toolchain DIR",
    ];
    sandbox.run("image").failed(&texts);
    sandbox.remove("rustup");
    sandbox
        .run("image")
        .failed(&["install rustup (https://rustup.rs; no administrator is needed), then rustup"]);
    assert_eq!(entries(&sandbox.cache("temporary")), 0);
}

#[test]
fn a_chosen_toolchain_must_be_complete() {
    let sandbox = Sandbox::new();
    let chosen = sandbox.path("mine");
    let with = |variable: &str| {
        Outcome::from(
            sandbox
                .command("image")
                .env(variable, &chosen)
                .output()
                .unwrap(),
        )
    };
    with("TEST_TOOLCHAIN").failed(&["mine: not a complete toolchain"]);
    fs::create_dir_all(chosen.join("bin")).unwrap();
    with("CRYSTAL_BALL_TOOLCHAIN").failed(&["bin/rustc is missing"]);
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
        .failed(&missing)
        .without_text("bin/rustc is missing");
    write_program(&sandbox.path("make"), &format!("{TOOLCHAIN}\ntoolchain $1"));
    assert!(
        Command::new(sandbox.path("make"))
            .arg(&chosen)
            .status()
            .unwrap()
            .success()
    );
    with("TEST_TOOLCHAIN").succeeded();
    assert!(!sandbox.cache("toolchain-1.96.0").exists());
}

#[test]
fn a_complete_rustup_toolchain_of_the_user_is_used_where_it_is() {
    let sandbox = Sandbox::new();
    let which = r#"
if [ $1 = which ]; then [ $RUSTUP_AUTO_INSTALL = 0 ] && echo $HOME/own/bin/rustc; exit; fi
echo got >>$HOME/rustup.log; exit 1"#;
    sandbox.program(
        "rustup",
        &format!("{TOOLCHAIN}\n[ -d $HOME/own ] || toolchain $HOME/own{which}"),
    );
    sandbox.run("image").succeeded();
    assert!(!sandbox.cache("toolchain-1.96.0").exists());
    assert!(!sandbox.path("home/rustup.log").exists());
    // Without its sources the toolchain is incomplete, and the set-up tries the next source.
    fs::remove_dir_all(sandbox.path("home/own/lib/rustlib/src")).unwrap();
    sandbox.run("image").failed(&["- rustup: "]);
    assert!(sandbox.path("home/rustup.log").exists());
}

#[test]
fn the_message_about_an_unusable_cache_names_its_folder() {
    let sandbox = Sandbox::new();
    fs::write(sandbox.path("file"), "").unwrap();
    let run = sandbox
        .command("image")
        .env("XDG_CACHE_HOME", sandbox.path("file"))
        .output()
        .unwrap();
    Outcome::from(run).failed(&[
        "file/crystal-ball: the cache folder cannot be used",
        "XDG_CACHE_HOME",
    ]);
}

/// Debian without rustup: `answers` is apt-get's script for URIs and downloads.
fn debian(answers: &str) -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.remove("rustup");
    sandbox.program("dpkg", "exit 1");
    sandbox.program("dpkg-query", "exit 0");
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
    sandbox.program("apt-get", &script);
    sandbox
}

#[test]
fn the_message_about_another_version_in_the_archive_names_both_versions() {
    let sandbox = debian(r#"offers 1.97.0+dfsg1-1 00 "$@""#);
    sandbox.run("image").failed(&[
        "rustc-web: Debian's archive has version 1.97.0+dfsg1-1",
        "Rust 1.96.0 is required",
        "--toolchain DIR",
    ]);
    let log = fs::read_to_string(sandbox.path("home/apt.log")).unwrap();
    assert!(
        log.contains("Dir::State::lists"),
        "newer lists are tried first, in a private folder:\n{log}"
    );
}

#[test]
fn a_damaged_download_is_refused() {
    let answers = r#"
    case "$*" in
    *print-uris*) offers 1.96.0+dfsg1-1 00 "$@" ;;
    *) for word; do echo hello >${word}_1.96.0+dfsg1-1_all.deb; done ;;
    esac"#;
    let sandbox = debian(answers);
    sandbox
        .run("image")
        .failed(&["the download is damaged", "SHA-256"]);
    assert_eq!(
        entries(&sandbox.cache("packages-1.96.0")),
        0,
        "no damaged package is kept"
    );
}

#[test]
fn debian_packages_make_the_toolchain_and_stay_in_the_cache() {
    let answers = r#"
    hash=5891b5b522d5df086d0ff0b110fbd9d21bb4fc7163af34d08286a2e846f6be03
    case "$*" in
    *print-uris*) offers 1.96.0+dfsg1-1 $hash "$@" ;;
    *) for word; do case $word in *rust*) echo hello >${word}_1.96.0+dfsg1-1_all.deb ;;
       *) echo hello >${word}_22_all.deb ;; esac; done ;;
    esac"#;
    let sandbox = debian(answers);
    let unpack = r#"
mkdir -p $3/usr/bin $3/usr/lib/x86_64-linux-gnu $3/usr/lib/llvm-22/bin $3/usr/lib/rustlib/src/rust/library/core/src
touch $3/usr/lib/rustlib/src/rust/library/core/src/lib.rs
cd $3/usr/lib/llvm-22/bin
for tool in llvm-objcopy llvm-objdump lld; do echo '#!/bin/sh' >$tool; chmod +x $tool; done
printf '#!/bin/sh\n[ -d $LD_LIBRARY_PATH/../rustlib ] || exit 1
echo "host: x86_64-unknown-linux-gnu"; echo "release: 1.96.0"' >$3/usr/bin/rustc; chmod +x $3/usr/bin/rustc"#;
    sandbox.program("dpkg", unpack);
    sandbox
        .run("image")
        .succeeded()
        .with_text(&["downloading Rust 1.96.0 as 7 Debian packages"]);
    let apt = || fs::read_to_string(sandbox.path("home/apt.log")).unwrap();
    let log = apt();
    assert!(!log.contains("update"), "the system's lists do:\n{log}");

    // Without the network and without the archive, which drops old versions: uses the kept packages.
    fs::remove_dir_all(sandbox.cache("toolchain-1.96.0")).unwrap();
    let offline = || {
        Outcome::from(
            sandbox
                .command("image")
                .env("CARGO_NET_OFFLINE", "1")
                .output()
                .unwrap(),
        )
    };
    offline().succeeded().without_text("downloading");
    assert_eq!(apt(), log);

    // Only a damaged package is fetched again.
    let damaged = "lld-22_22_all.deb";
    fs::write(sandbox.cache("packages-1.96.0").join(damaged), "hell").unwrap();
    fs::remove_dir_all(sandbox.cache("toolchain-1.96.0")).unwrap();
    offline().failed(&["offline"]);
    sandbox.run("image").succeeded();
    let last = apt().lines().last().unwrap().to_owned();
    assert!(last.ends_with(" download lld-22"), "{last}");
}

#[test]
fn a_failed_download_keeps_the_complete_packages() {
    // The hash of "hello\n"; the disk is full after the first package.
    let answers = r#"
    hash=5891b5b522d5df086d0ff0b110fbd9d21bb4fc7163af34d08286a2e846f6be03
    case "$*" in
    *print-uris*) offers 1.96.0+dfsg1-1 $hash "$@" ;;
    *) echo hello >rustc-web_1.96.0+dfsg1-1_all.deb
       echo "E: write (28: No space left on device)" >&2; exit 100 ;;
    esac"#;
    let sandbox = debian(answers);
    sandbox
        .run("image")
        .failed(&["No space left on device", "apt-get"]);
    assert_eq!(entries(&sandbox.cache("packages-1.96.0")), 1);
    assert_eq!(entries(&sandbox.cache("temporary")), 0);
}

/// The real cargo reports the settings that it finds where the nested builds run, and where `cargo install`
/// looks for them: in its home and above.
#[test]
fn the_users_cargo_settings_do_not_reach_the_builds() {
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
    let sandbox = Sandbox::new();
    let cargo = format!(
        r#"
config() {{ {} -Zunstable-options config get; }}
{{ config; env; }} >>$HOME/settings.log
case $* in */boot/image/*) (cd $CARGO_HOME/registry; config) >>$HOME/settings.log ;; esac
{CARGO}"#,
        env!("CARGO")
    );
    sandbox.program("cargo", &cargo);
    // Above the clone, which is the current folder; above the cache; and in cargo's home.
    for folder in [".cargo", "home/.cargo"] {
        fs::create_dir(sandbox.path(folder)).unwrap();
        fs::write(sandbox.path(folder).join("config.toml"), HOSTILE).unwrap();
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
    let mut run = sandbox.command("image");
    Outcome::from(run.envs(hostile).output().unwrap()).succeeded();
    sandbox.assert_complete();
    let log = fs::read_to_string(sandbox.path("home/settings.log")).unwrap();
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
fn a_missing_qemu_is_unpacked_into_the_cache() {
    let sandbox = Sandbox::new();
    sandbox.remove("qemu-system-x86_64");
    sandbox.run("qemu").failed(&[
        "QEMU: not installed",
        "this is not a Debian system",
        "ask your administrator",
        "sudo apt-get install qemu-system-x86",
        "--qemu PATH",
    ]);
    sandbox
        .run("doctor")
        .failed(&["MISSING QEMU", "package manager"]);
    sandbox.debian_with_qemu();
    sandbox
        .run("doctor")
        .failed(&["the next run unpacks Debian's package qemu-system-x86"]);
    sandbox.run("qemu").succeeded().with_text(&[
        "downloading QEMU as 2 Debian packages (12 B), once",
        "unpacking QEMU",
        "QEMU is in ",
    ]);
    assert_eq!(
        sandbox.run("qemu").succeeded().text,
        "",
        "the QEMU in the cache is used"
    );
    let log = || fs::read_to_string(sandbox.path("home/apt.log")).unwrap();
    let downloaded = |line: &&str| line.contains(" download ") && line.contains("libsame");
    assert_eq!(log().lines().find(downloaded), None, "the system has it");
    // The installation is planned and downloaded, but not carried out.
    let installs = |line: &&str| line.contains(" install ") && !line.contains("--print-uris");
    assert_eq!(log().lines().find(installs), None);

    // QEMU no longer starts, since a library of the system is gone; it is unpacked again.
    write_program(
        &sandbox.cache("qemu/usr/bin/qemu-system-x86_64"),
        "exit 127",
    );
    sandbox.run("qemu").succeeded().with_text(&[
        "the cached QEMU does not work and is not used",
        "unpacking QEMU",
    ]);
    // Without the network, the cached QEMU is used even if it has no window.
    let offline = |what| {
        let mut command = sandbox.command(what);
        Outcome::from(command.env("CARGO_NET_OFFLINE", "1").output().unwrap())
    };
    offline("qemu").succeeded();
    offline("window")
        .succeeded()
        .with_text(&["cannot open a window", "offline"]);
    // A QEMU with a window replaces the other.
    sandbox
        .run("window")
        .succeeded()
        .with_text(&["downloading QEMU and its window"]);
    assert_eq!(sandbox.run("window").succeeded().text, "");
    assert_eq!(
        entries(&sandbox.cache("")),
        3,
        "lock, temporary folders, QEMU"
    );
    assert_eq!(entries(&sandbox.cache("temporary")), 0);
}

#[test]
fn the_qemu_of_a_debian_suite_does_not_replace_the_systems_qemu() {
    let sandbox = Sandbox::new();
    sandbox.debian_with_qemu();
    let of = |suite: &str| {
        let mut command = sandbox.command("suite");
        Outcome::from(command.env("TEST_SUITE", suite).output().unwrap())
    };
    of("sid")
        .succeeded()
        .with_text(&["unpacking QEMU", "qemu-sid"]);
    assert_eq!(of("sid").succeeded().text, "");
    let log = fs::read_to_string(sandbox.path("home/apt.log")).unwrap();
    assert!(log.contains("-t sid"), "{log}");
    for other in ["", "../x", "-o", "a b"] {
        of(other).failed(&["not the name of a Debian suite"]);
    }
}

#[test]
fn a_full_disk_ends_the_search_for_a_compiler() {
    let sandbox = debian("exit 1");
    sandbox.program(
        "rustup",
        "echo 'error: could not write: No space left on device (os error 28)' >&2; exit 1",
    );
    sandbox
        .run("image")
        .failed(&["No space left on device"])
        .without_text("Debian");
    assert!(!sandbox.path("home/apt.log").exists());
}

#[test]
fn a_missing_window_is_not_an_error() {
    let sandbox = Sandbox::new();
    sandbox.program("qemu-system-x86_64", &QEMU.replace("gtk", "curses"));
    sandbox
        .run("window")
        .succeeded()
        .with_text(&["cannot open a window", "install qemu-system-gui"]);
    sandbox.run("ready").succeeded().without_text("window");
}

#[test]
fn an_interrupted_set_up_leaves_no_temporary_folder() {
    let sandbox = Sandbox::new();
    sandbox.program("cargo", "echo working >&2; sleep 60");
    let child = sandbox.command("image").spawn().unwrap();
    wait_for(|| {
        sandbox.cache("temporary").exists()
            && entries(&sandbox.cache("temporary")) > 0
            && sandbox.cache("toolchain-1.96.0").exists()
    });
    signal(&child, "TERM");
    let outcome = Outcome::from(child.wait_with_output().unwrap());
    assert_eq!(
        outcome.code,
        Some(Interrupted::EXIT_CODE),
        "{}",
        outcome.text
    );
    assert_eq!(entries(&sandbox.cache("temporary")), 0);
}

#[test]
fn children_and_grandchildren_end_with_the_set_up() {
    for signal_name in ["KILL", "TERM"] {
        let sandbox = Sandbox::new();
        let beat = sandbox.path("beat");
        let beats = || fs::metadata(&beat).map_or(0, |data| data.len());
        let script = format!(
            "sh -c 'while :; do echo >>{}; sleep 0.02; done' & wait",
            beat.display()
        );
        sandbox.program("cargo", &script);
        let mut child = sandbox.command("image").spawn().unwrap();
        wait_for(|| beats() > 3);
        signal(&child, signal_name);
        child.wait().unwrap();
        sleep(Duration::from_millis(200));
        let then = beats();
        sleep(Duration::from_millis(200));
        assert_eq!(
            beats(),
            then,
            "a grandchild is still running after {signal_name}"
        );
    }
}

/// Uses the compiler and the builds of this machine: a quarter of an hour. Each run finds what the previous
/// run has finished, so each of these moments is in another step: download, unpacking, boot loader, kernel.
#[test]
#[ignore = "downloads the compiler and builds the boot loader, several times"]
fn a_real_set_up_continues_after_a_kill() {
    let sandbox = Sandbox::empty(true);
    for seconds in [1, 2, 4, 8, 12, 16, 30, 60, 100, 150] {
        let mut child = sandbox
            .command("image")
            .stderr(Stdio::inherit())
            .spawn()
            .unwrap();
        sleep(Duration::from_secs(seconds));
        child.kill().unwrap();
        let killed = child.wait().unwrap().signal();
        writeln!(std::io::stderr(), "*** after {seconds} s: {killed:?}").unwrap();
    }
    sandbox.run("image").succeeded();
    assert!(fs::metadata(sandbox.image()).unwrap().len() > 1_000_000);
    assert_eq!(entries(&sandbox.cache("temporary")), 0);
}

/// Kills a set-up at ten moments, each time in a new sandbox; each time the next run must succeed.
#[test]
fn a_set_up_continues_after_a_kill() {
    let reference = Sandbox::new();
    let begun = Instant::now();
    reference.run("image").succeeded();
    let length = begun.elapsed();
    for moment in 1..=10 {
        let sandbox = Sandbox::new();
        let mut child = sandbox
            .command("image")
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(length * moment / 11);
        child.kill().unwrap();
        child.wait().unwrap();
        sandbox.run("image").succeeded();
        sandbox.assert_complete();
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
