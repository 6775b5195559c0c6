//! The user's cargo settings that reach the nested builds: how to reach the network, and nothing else.
//!
//! The kernel and the boot loader run on a bare machine. A `target-cpu`, a linker, a wrapper, a profile or a
//! target folder that suits the user's programs breaks them. So a nested cargo gets an environment with known
//! variables only, a private home folder, and a current folder that has no harmful configuration file in it
//! or above it. (`cargo install`, which the boot loader's build uses, searches for configuration files from
//! cargo's home upward; `cargo build` searches from the current folder upward.)

use std::env;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use tempfile::TempDir;
use toml::{Table, Value};

use super::sha256::sha256;

/// The tables that are carried over: the sources of packages, and how to reach them.
const NETWORK: [&str; 6] = [
    "credential-alias",
    "http",
    "net",
    "registries",
    "registry",
    "source",
];

/// Further tables that do not change the result of a build.
const HARMLESS: [&str; 5] = [
    "alias",
    "cache",
    "cargo-new",
    "future-incompat-report",
    "term",
];

/// How deep configuration files may include others.
const DEPTH: usize = 8;

/// Returns the environment variables that reach a nested cargo: those of the user, the terminal and the
/// network.
pub fn kept(variables: impl Iterator<Item = (OsString, OsString)>) -> Vec<(OsString, OsString)> {
    variables
        .filter(|(name, _)| is_kept(&name.to_string_lossy()))
        .collect()
}

fn is_kept(name: &str) -> bool {
    const NAMES: [&str; 19] = [
        "CARGO_BUILD_JOBS",
        "CURL_CA_BUNDLE",
        "DBUS_SESSION_BUS_ADDRESS",
        "HOME",
        "LANG",
        "LOGNAME",
        "NETRC",
        "NIX_SSL_CERT_FILE",
        "NO_COLOR",
        "PATH",
        "RUSTUP_HOME",
        "SSH_AGENT_PID",
        "SSH_AUTH_SOCK",
        "SSL_CERT_DIR",
        "SSL_CERT_FILE",
        "TERM",
        "TMPDIR",
        "USER",
        "XDG_RUNTIME_DIR",
    ];
    const BEGINNINGS: [&str; 8] = [
        "CARGO_HTTP_",
        "CARGO_NET_",
        "CARGO_REGISTRIES_",
        "CARGO_REGISTRY_",
        "CARGO_TERM_",
        "GIT_SSH",
        "GIT_SSL_",
        "LC_",
    ];
    NAMES.contains(&name)
        || BEGINNINGS.iter().any(|begin| name.starts_with(begin))
        || name.to_ascii_lowercase().ends_with("_proxy")
}

/// Returns the user's cargo home.
pub fn home() -> Option<PathBuf> {
    env::var_os("CARGO_HOME")
        .filter(|home| !home.is_empty())
        .map(PathBuf::from)
        .or_else(|| Some(env::home_dir()?.join(".cargo")))
}

/// Returns the configuration files that cargo reads in `folder`, in order of decreasing priority.
pub fn files(folder: &Path, home: Option<&Path>) -> Vec<PathBuf> {
    let mut folders: Vec<_> = folder
        .ancestors()
        .map(|folder| folder.join(".cargo"))
        .collect();
    folders.extend(home.map(Path::to_owned));
    let mut files: Vec<PathBuf> = Vec::new();
    // If a folder has both `config` and `config.toml`, cargo reads `config`. The home can itself be one of
    // the `.cargo` folders, so a file is listed only once.
    for folder in folders {
        let names = ["config", "config.toml"].map(|name| folder.join(name));
        let file = names.into_iter().find(|file| file.is_file());
        files.extend(file.filter(|file| !files.contains(file)));
    }
    files
}

/// Reads a configuration file and the files that it includes. A broken file gives an empty table: cargo
/// itself reports it.
pub fn read(file: &Path) -> Table {
    read_to(file, DEPTH)
}

fn read_to(file: &Path, depth: usize) -> Table {
    let text = fs::read_to_string(file).unwrap_or_default();
    let mut table: Table = text.parse().unwrap_or_default();
    let included = match table.remove("include") {
        Some(Value::Array(included)) => included,
        Some(one) => vec![one],
        None => Vec::new(),
    };
    // Paths are relative to the folder that has the `.cargo`.
    let folder = file.parent().unwrap_or(Path::new("/"));
    make_absolute(&mut table, folder.parent().unwrap_or(folder));
    for other in included.iter().rev().filter(|_| depth > 0) {
        let path = other.as_str().or_else(|| other.get("path")?.as_str());
        if let Some(path) = path {
            add_below(&mut table, read_to(&folder.join(path), depth - 1));
        }
    }
    table
}

/// Makes the relative paths in the carried-over tables absolute.
fn make_absolute(table: &mut Table, folder: &Path) {
    let absolute = |value: Option<&mut Value>| {
        if let Some(Value::String(path)) = value {
            *path = folder.join(&*path).to_string_lossy().into_owned();
        }
    };
    let within = |table: &mut Table, name: &str| match table.get_mut(name) {
        Some(Value::Table(inner)) => std::mem::take(inner),
        _ => Table::new(),
    };
    let mut http = within(table, "http");
    absolute(http.get_mut("cainfo"));
    let mut sources = within(table, "source");
    for (_, source) in &mut sources {
        absolute(source.get_mut("directory"));
        absolute(source.get_mut("local-registry"));
    }
    for (name, inner) in [("http", http), ("source", sources)] {
        if !inner.is_empty() {
            table.insert(name.to_owned(), Value::Table(inner));
        }
    }
}

/// Adds the settings of a configuration with lower priority.
fn add_below(table: &mut Table, below: Table) {
    for (name, value) in below {
        match (table.get_mut(&name), value) {
            (None, value) => {
                table.insert(name, value);
            }
            (Some(Value::Table(inner)), Value::Table(below)) => add_below(inner, below),
            // Cargo joins arrays, with the highest priority last.
            (Some(Value::Array(inner)), Value::Array(mut below)) => {
                below.append(inner);
                *inner = below;
            }
            _ => {}
        }
    }
}

/// Returns the network settings of these files.
fn network(files: &[PathBuf]) -> Table {
    let mut table = Table::new();
    for file in files {
        add_below(&mut table, read(file));
    }
    table.retain(|name, _| NETWORK.contains(&name));
    table
}

/// Makes `place` a cargo home with the user's downloaded packages and network settings, and nothing else.
///
/// # Errors
/// If `place` cannot be written.
pub fn make_home(place: &Path, folder: &Path, user: Option<&Path>) -> anyhow::Result<()> {
    let unusable = || format!("{}: no cargo home can be made here", place.display());
    let mut settings = network(&files(folder, user));
    // Cargo's automatic clean-up would remove packages that the user's cargo still uses.
    let never = Table::from_iter([("auto-clean-frequency".to_owned(), "never".into())]);
    settings.insert("cache".to_owned(), never.into());
    fs::create_dir_all(place.join("registry")).with_context(unusable)?;
    fs::write(place.join("config.toml"), settings.to_string()).with_context(unusable)?;
    // The lock files are shared with the folders that they guard. `registry/src` is not shared: the boot
    // loader's build script runs in it, and must not find the user's configuration above it.
    for name in [
        "registry/index",
        "registry/cache",
        ".package-cache",
        ".package-cache-mutate",
        "credentials",
        "credentials.toml",
    ] {
        let link = place.join(name);
        if link.is_symlink() {
            fs::remove_file(&link).with_context(unusable)?;
        }
        let Some(theirs) = user.map(|user| user.join(name)) else {
            continue;
        };
        if theirs.exists() && !link.exists() {
            symlink(theirs, link).with_context(unusable)?;
        }
    }
    Ok(())
}

/// Returns an empty temporary folder with no configuration file in it or above it that would change the
/// result of a build. The folder's name has a hash of `name`, so that each cache has its own folder, and the
/// next run finds and removes a folder that a killed run left.
///
/// # Errors
/// If no folder for temporary files is suitable.
pub fn neutral(name: &OsStr) -> anyhow::Result<TempDir> {
    let places = [
        env::temp_dir(),
        "/tmp".into(),
        "/var/tmp".into(),
        "/dev/shm".into(),
    ];
    let mut why = Vec::new();
    for place in places {
        if let Some(file) = harmful(&place) {
            why.push(format!(
                "{}: {} applies there",
                place.display(),
                file.display()
            ));
            continue;
        }
        match neutral_in(&place, name) {
            Ok(folder) => return Ok(folder),
            Err(error) => why.push(format!("{}: {error}", place.display())),
        }
    }
    why.dedup();
    bail!(
        "the boot loader must be built in a folder that no cargo configuration applies to, and every folder for \
         temporary files failed:\n  {}\n\
         move that configuration to $CARGO_HOME/config.toml, or set TMPDIR to another folder",
        why.join("\n  ")
    )
}

fn neutral_in(place: &Path, name: &OsStr) -> std::io::Result<TempDir> {
    let name = format!(
        "crystal-ball-cargo-{}",
        &sha256(name.as_encoded_bytes())[..16]
    );
    match fs::remove_dir_all(place.join(&name)) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    tempfile::Builder::new()
        .prefix(&name)
        .rand_bytes(0)
        .permissions(fs::Permissions::from_mode(0o700))
        .tempdir_in(place)
}

/// Returns a configuration file, in or above a folder, with settings that could change the result of a
/// build.
fn harmful(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().ok()?;
    let has_other_tables = |file: &PathBuf| {
        let table = read(file);
        let known = |name: &String| [&NETWORK[..], &HARMLESS].concat().contains(&name.as_str());
        !table.keys().all(known)
    };
    files(&folder, None).into_iter().find(has_other_tables)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path, text: &str) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    #[test]
    fn only_known_variables_reach_a_nested_cargo() {
        for lost in [
            "CARGO",
            "CARGO_HOME",
            "CARGO_MANIFEST_DIR",
            "CARGO_TARGET_DIR",
            "CARGO_BUILD_TARGET",
            "CARGO_BUILD_RUSTFLAGS",
            "CARGO_BUILD_RUSTC_WRAPPER",
            "CARGO_ENCODED_RUSTFLAGS",
            "CARGO_PROFILE_RELEASE_LTO",
            "CARGO_TARGET_X86_64_UNKNOWN_NONE_RUSTFLAGS",
            "CARGO_UNSTABLE_BUILD_STD",
            "CARGO_INCREMENTAL",
            "CARGO_MAKEFLAGS",
            "CC",
            "CFLAGS",
            "LD_LIBRARY_PATH",
            "MAKEFLAGS",
            "RUSTC",
            "RUSTC_WRAPPER",
            "RUSTC_WORKSPACE_WRAPPER",
            "RUSTC_LINKER",
            "RUSTDOCFLAGS",
            "RUSTFLAGS",
            "RUSTUP_TOOLCHAIN",
            "RUST_RECURSION_COUNT",
            "__CARGO_DEFAULT_LIB_METADATA",
        ] {
            assert!(!is_kept(lost), "{lost}");
        }
        for kept in [
            "CARGO_NET_OFFLINE",
            "CARGO_HTTP_PROXY",
            "CARGO_REGISTRIES_MINE_INDEX",
            "RUSTUP_HOME",
            "https_proxy",
            "NO_PROXY",
            "LC_ALL",
            "PATH",
        ] {
            assert!(is_kept(kept), "{kept}");
        }
    }

    #[test]
    fn the_nested_cargo_home_has_only_the_network_settings() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        write(
            &at("user/config.toml"),
            r#"
            include = "more.toml"
            [build]
            rustflags = ["-C", "target-cpu=native"]
            target = "x86_64-unknown-linux-gnu"
            rustc-wrapper = "sccache"
            target-dir = "/somewhere"
            [target.x86_64-unknown-none]
            rustflags = ["-C", "link-arg=-fuse-ld=mold"]
            [profile.release]
            debug = true
            [unstable]
            build-std = ["std"]
            [env]
            RUSTFLAGS = "-C opt-level=0"
            [patch.crates-io]
            x = { path = "x" }
            [http]
            timeout = 5
            cainfo = "certificates"
            [net]
            retry = 1
            "#,
        );
        write(
            &at("user/more.toml"),
            "[net]\nretry = 9\ngit-fetch-with-cli = true\n[source.crates-io]\nreplace-with = 'mine'",
        );
        write(
            &at("up/.cargo/config.toml"),
            "[net]\nretry = 3\n[source.mine]\ndirectory = 'vendor'\n[profile.dev]\nlto = true",
        );
        fs::create_dir_all(at("up/clone")).unwrap();
        fs::create_dir_all(at("user/registry/cache")).unwrap();
        write(&at("user/.package-cache"), "");
        let user = at("user");
        // Twice: the second call finds the files of the first.
        for _ in 0..2 {
            make_home(&at("home"), &at("up/clone"), Some(&user)).unwrap();
        }
        let expected = format!(
            "[cache]\nauto-clean-frequency = 'never'\n[http]\ntimeout = 5\ncainfo = '{0}/certificates'\n\
             [net]\nretry = 3\ngit-fetch-with-cli = true\n\
             [source.crates-io]\nreplace-with = 'mine'\n[source.mine]\ndirectory = '{0}/up/vendor'",
            place.path().display()
        );
        let made = fs::read_to_string(at("home/config.toml")).unwrap();
        assert_eq!(made.parse::<Table>().unwrap(), expected.parse().unwrap());
        assert_eq!(
            fs::read_link(at("home/registry/cache")).unwrap(),
            at("user/registry/cache")
        );
        assert!(at("home/.package-cache").is_symlink());
        for not in ["home/registry/index", "home/registry/src", "home/bin"] {
            assert!(!at(not).exists() && !at(not).is_symlink(), "{not}");
        }
    }

    #[test]
    fn the_neutral_folder_is_not_below_a_cargo_configuration() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("down");
        fs::create_dir(&folder).unwrap();
        let file = place
            .path()
            .canonicalize()
            .unwrap()
            .join(".cargo/config.toml");
        for harmless in ["", "[alias]\nr = 'run'\n[net]\nretry = 3", "[broken"] {
            write(&file, harmless);
            assert_eq!(harmful(&folder), None, "{harmless}");
        }
        for harm in ["build.jobs = 1", "[unstable]", "[profile.dev]\nlto = true"] {
            write(&file, harm);
            assert_eq!(harmful(&folder).as_ref(), Some(&file), "{harm}");
        }
        let name = OsStr::new("a cache");
        // A folder that a killed run left is removed.
        let left = neutral_in(&folder, name).unwrap().keep();
        fs::write(left.join("file"), "").unwrap();
        let again = neutral_in(&folder, name).unwrap();
        assert_eq!(again.path(), left);
        assert_eq!(fs::read_dir(&left).unwrap().count(), 0);
        drop(again);
        assert!(!left.exists());
    }
}
