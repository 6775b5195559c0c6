//! Downloads Debian packages and unpacks them into the cache, without root and without a change to the
//! system.
//!
//! apt-get decides which packages a package needs. It plans as if the system were empty, because a plan for
//! the real system may fail or remove packages. The packages that the system already has are then left out.
//! Here apt-get only lists and downloads; it never installs.

use std::collections::HashSet;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, anyhow, bail};
use tempfile::TempDir;

use super::cache::{self, LockedCache, is_full};
use super::offline::offline;
use super::sha256::sha256;
use system::{Interrupted, child};
use system::{Progress, bytes};

/// The file that lists a folder's packages, in apt-get's format. It is written after all packages have
/// arrived.
const LIST: &str = "list";

/// The machine's name, the same in Debian's and in Rust's paths.
pub const MACHINE: &str = std::env::consts::ARCH;

/// Settings that turn off two parts of apt-get: the system's hooks, which change the system's caches when
/// root runs them, and indexes that this program does not read.
const CONFIGURATION: &str = r#"
#clear APT::Update::Pre-Invoke;
#clear APT::Update::Post-Invoke;
#clear APT::Update::Post-Invoke-Success;
Acquire::Languages "none";
Acquire::IndexTargets::deb::DEP-11::DefaultEnabled "false";
Acquire::IndexTargets::deb::DEP-11-icons::DefaultEnabled "false";
Acquire::IndexTargets::deb::DEP-11-icons-small::DefaultEnabled "false";
Acquire::IndexTargets::deb::DEP-11-icons-hidpi::DefaultEnabled "false";
Acquire::IndexTargets::deb::CNF::DefaultEnabled "false";
Acquire::IndexTargets::deb-src::Sources::DefaultEnabled "false";
"#;

/// A request for packages.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The name of the software in messages, such as `Rust 1.96.0`.
    pub what: &'a str,
    /// Packages to fetch without their dependencies.
    pub without_dependencies: &'a [&'a str],
    /// Packages to fetch with every dependency that this system does not have in the same version.
    pub with_dependencies: &'a [&'a str],
    /// Prefixes of package names. Packages with such a name are fetched even if the system has them.
    pub always: &'a [&'a str],
    /// Packages to leave out even if the system has another version.
    pub never: &'a [&'a str],
    /// The suite of Debian to fetch from, such as `bookworm-backports`, or `None` for the system's suites.
    pub suite: Option<&'a str>,
    /// Returns an error that says why a package is not suitable.
    pub check: fn(&Package) -> anyhow::Result<()>,
    /// Returns the bytes of disk space needed to unpack `bytes` of packages; the download is not included.
    pub room: fn(bytes: u64) -> u64,
}

/// A package, as `apt-get --print-uris download` lists it.
#[derive(Debug, PartialEq, Eq)]
pub struct Package {
    file: String,
    bytes: u64,
    sha256: String,
}

impl Package {
    /// Parses `'URI' FILE BYTES SHA256:HASH`.
    fn parse(line: &str) -> Option<Self> {
        let mut fields = line.strip_prefix('\'')?.split_once("' ")?.1.split(' ');
        let (file, bytes) = (fields.next()?.to_owned(), fields.next()?.parse().ok()?);
        let sha256 = fields.next()?.strip_prefix("SHA256:")?.to_owned();
        Some(Self {
            file,
            bytes,
            sha256,
        })
    }

    fn parse_all(text: &str) -> Vec<Self> {
        text.lines().filter_map(Self::parse).collect()
    }

    /// Returns the package's name.
    pub fn name(&self) -> &str {
        self.file.split('_').next().unwrap_or_default()
    }

    /// Returns the package's version, as its file name spells it.
    pub fn version(&self) -> &str {
        self.file.split('_').nth(1).unwrap_or_default()
    }

    /// Returns a package with only a file name, for tests.
    #[cfg(test)]
    pub fn of_file(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            bytes: 0,
            sha256: String::new(),
        }
    }

    /// Returns whether `folder` has the package, complete and unchanged.
    fn is_in(&self, folder: &Path) -> bool {
        fs::read(folder.join(&self.file)).is_ok_and(|data| sha256(&data) == self.sha256)
    }
}

impl Display for Package {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "'' {} {} SHA256:{}", self.file, self.bytes, self.sha256)
    }
}

/// Returns whether this system has the Debian programs that this module runs.
pub fn is_here() -> bool {
    ["apt-get", "dpkg", "dpkg-query"]
        .map(which::which)
        .iter()
        .all(Result::is_ok)
}

/// Returns the packages that an earlier [`fetch`] put into `folder`, if all of them exist and are unchanged.
pub fn kept(folder: &Path) -> Option<Vec<Package>> {
    let list = Package::parse_all(&fs::read_to_string(folder.join(LIST)).ok()?);
    let complete = !list.is_empty() && missing(&list, folder).is_empty();
    complete.then_some(list)
}

/// Fetches packages into `folder`, by the system's package lists, or by private lists if the system's are
/// missing or old.
///
/// # Errors
/// If cargo is offline, this is no Debian system, the archive lacks a package, or a download is incomplete.
pub fn fetch(
    cache: &LockedCache,
    request: &Request,
    folder: &Path,
) -> anyhow::Result<Vec<Package>> {
    if let Some(setting) = offline() {
        bail!("cargo is offline ({setting}), so nothing is downloaded");
    }
    if !is_here() {
        bail!("this is not a Debian system: apt-get, dpkg or dpkg-query is missing");
    }
    let get = |apt: &Apt| {
        let list = apt.list(cache, request)?;
        download(cache, apt, request, list, folder)
    };
    // The system's lists know only the system's suites.
    if request.suite.is_none() {
        match get(&Apt::of_system(cache)?) {
            Err(error) if !error.is::<Interrupted>() && !is_full(&error) => {}
            done => return done,
        }
    }
    let apt = Apt::with_lists(cache, request.suite)?;
    let step = Progress::new(
        "downloading the lists of Debian's packages into a temporary folder",
        0,
    );
    // The exit code of `update` is that of its worst source. All that matters is whether the packages are
    // found afterwards.
    let updated = watch(apt.command().args(["--error-on=any", "update"]), step, || 0);
    match (get(&apt), updated) {
        (Err(error), Err(update)) if !error.is::<Interrupted>() && !is_full(&error) => {
            Err(anyhow!("{update:#}\n{error:#}"))
        }
        (done, _) => done,
    }
}

/// Unpacks the packages in `folder` into the folder `into`, with all programs and libraries below its `usr`.
///
/// # Errors
/// If dpkg is missing or fails.
pub fn unpack(what: &str, packages: &[Package], folder: &Path, into: &Path) -> anyhow::Result<()> {
    let dpkg = which::which("dpkg").context("this is not a Debian system: dpkg is missing")?;
    let total = packages.iter().map(|package| package.bytes).sum();
    let mut step = Progress::new(format_args!("unpacking {what}"), total);
    let mut done = 0;
    for package in packages {
        let mut unpack = child::family(&dpkg);
        unpack.arg("-x").arg(folder.join(&package.file)).arg(into);
        child::watch(&mut unpack, |event| step.on(event, || done))?;
        done += package.bytes;
        step.at(done);
    }
    // Older packages have files in `/lib` that belong in `/usr/lib`.
    for name in ["bin", "sbin", "lib", "lib64"] {
        let from = into.join(name);
        if from.is_dir() {
            merge(&from, &into.join("usr").join(name))?;
        }
    }
    Ok(())
}

/// Moves the contents of the folder `from` to `to`, and removes `from`.
fn merge(from: &Path, to: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let place = to.join(entry.file_name());
        if entry.file_type()?.is_dir() && place.is_dir() {
            merge(&entry.path(), &place)?;
        } else {
            fs::rename(entry.path(), place)?;
        }
    }
    cache::remove(from)
}

/// Runs a command and shows its progress.
fn watch(
    command: &mut Command,
    mut step: Progress,
    done: impl Fn() -> u64,
) -> anyhow::Result<String> {
    child::watch(command, |event| step.on(event, &done))
}

/// Returns the packages of a list that are not yet in `folder`.
fn missing<'a>(list: &'a [Package], folder: &Path) -> Vec<&'a Package> {
    list.iter()
        .filter(|package| !package.is_in(folder))
        .collect()
}

/// Downloads the packages that are not yet in `folder`, and writes the folder's list.
fn download(
    cache: &LockedCache,
    apt: &Apt,
    request: &Request,
    list: Vec<Package>,
    folder: &Path,
) -> anyhow::Result<Vec<Package>> {
    let missing = missing(&list, folder);
    let sum = |packages: &[&Package]| packages.iter().map(|package| package.bytes).sum::<u64>();
    let total = sum(&missing);
    let all: Vec<_> = list.iter().collect();
    cache.room(total + (request.room)(sum(&all)), request.what)?;
    let temporary = cache.temporary_folder()?;
    if !missing.is_empty() {
        let step = Progress::new(
            format_args!(
                "downloading {} as {} Debian packages ({}), once",
                request.what,
                missing.len(),
                bytes(total)
            ),
            total,
        );
        let mut get = apt.command();
        get.arg("download")
            .args(missing.iter().map(|package| package.name()))
            .current_dir(temporary.path());
        let got = watch(&mut get, step, || cache::size(temporary.path()));
        fs::create_dir_all(folder)?;
        // Even after a failure, so that complete packages need not be fetched again.
        for package in missing
            .iter()
            .filter(|package| package.is_in(temporary.path()))
        {
            fs::rename(
                temporary.path().join(&package.file),
                folder.join(&package.file),
            )?;
        }
        got?;
    }
    if let Some(package) = missing.iter().find(|package| !package.is_in(folder)) {
        let (file, hash) = (&package.file, &package.sha256);
        bail!("{file}: the download is damaged: its SHA-256 is not {hash}; try again");
    }
    let text: String = list.iter().map(|package| format!("{package}\n")).collect();
    fs::write(temporary.path().join(LIST), text)?;
    fs::rename(temporary.path().join(LIST), folder.join(LIST))?;
    Ok(list)
}

/// apt-get, with the system's package lists or with private lists.
struct Apt<'a> {
    /// The folder of the configuration and the private lists.
    folder: TempDir,
    private_lists: bool,
    suite: Option<&'a str>,
}

impl<'a> Apt<'a> {
    fn of_system(cache: &LockedCache) -> anyhow::Result<Self> {
        let folder = cache.temporary_folder()?;
        fs::write(folder.path().join("apt.conf"), CONFIGURATION)?;
        Ok(Self {
            folder,
            private_lists: false,
            suite: None,
        })
    }

    fn with_lists(cache: &LockedCache, suite: Option<&'a str>) -> anyhow::Result<Self> {
        let mut apt = Self {
            private_lists: true,
            ..Self::of_system(cache)?
        };
        // apt-get does not create these folders.
        for folder in ["lists/partial", "cache/archives/partial"] {
            fs::create_dir_all(apt.folder.path().join(folder))?;
        }
        if let Some(suite) = suite {
            apt.add_source(suite)?;
            apt.suite = Some(suite);
        }
        Ok(apt)
    }

    /// Makes a folder of sources: the system's sources, and this suite of the same archive.
    fn add_source(&self, suite: &str) -> anyhow::Result<()> {
        // apt-get prints the URIs that it would fetch: `'http://HOST/debian/dists/bookworm/InRelease' ...`.
        let mut update = self.command();
        let known = child::run(update.args(["--print-uris", "update"]))?;
        let archive = known
            .lines()
            .filter_map(|line| Some(line.strip_prefix('\'')?.split_once("/dists/")?.0))
            .find(|uri| uri.ends_with("/debian"))
            .context("apt-get: none of the package sources is Debian's archive (a URI that ends in /debian)")?;
        let folder = self.folder.path().join("sources");
        fs::create_dir(&folder)?;
        for entry in fs::read_dir("/etc/apt/sources.list.d")
            .into_iter()
            .flatten()
            .flatten()
        {
            symlink(entry.path(), folder.join(entry.file_name()))?;
        }
        let line = format!("deb {archive} {suite} main\n");
        fs::write(folder.join("crystal-ball.list"), line)?;
        Ok(())
    }

    fn command(&self) -> Command {
        let mut command = child::family("apt-get");
        let folder = self.folder.path();
        // Run by root, apt-get would download as another user, who cannot write to the cache, and print a
        // warning.
        command
            .env("LC_ALL", "C")
            .args(["-q", "-o", "APT::Sandbox::User=root", "-c"])
            .arg(folder.join("apt.conf"));
        if !self.private_lists {
            // Run by root, apt-get would rewrite the system's index of its lists.
            for index in ["pkgcache", "srcpkgcache"] {
                command.args(["-o", &format!("Dir::Cache::{index}=")]);
            }
        }
        let mut place = |option: &str, name: &str| {
            let place = format!("{option}={}", folder.join(name).display());
            command.args(["-o", &place]);
        };
        if self.private_lists {
            place("Dir::State::lists", "lists");
            place("Dir::Cache", "cache");
        }
        if self.suite.is_some() {
            place("Dir::Etc::sourceparts", "sources");
        }
        if let Some(suite) = self.suite {
            command.args(["-t", suite]);
        }
        command
    }

    /// Returns the packages to fetch: the requested packages that this system lacks, and their dependencies.
    fn list(&self, cache: &LockedCache, request: &Request) -> anyhow::Result<Vec<Package>> {
        let alone = request
            .without_dependencies
            .iter()
            .copied()
            .map(str::to_owned);
        // Query the first package alone. Its name holds no version, so the archive knows it, and `check` can
        // report its version. With a name whose version the archive lacks, apt-get would list nothing.
        if let Some(first) = request.without_dependencies.first() {
            let first = [(*first).to_owned()];
            self.uris(cache, &first)?
                .iter()
                .try_for_each(request.check)?;
        }
        let names: Vec<_> = alone.chain(self.needed(request)?).collect();
        let list = self.uris(cache, &names)?;
        list.iter().try_for_each(request.check)?;
        match names
            .iter()
            .find(|name| !list.iter().any(|package| package.name() == *name))
        {
            Some(name) => bail!("apt-get: no download address for the package {name}"),
            None => Ok(list),
        }
    }

    /// Returns the archive's packages with these names.
    fn uris(&self, cache: &LockedCache, names: &[String]) -> anyhow::Result<Vec<Package>> {
        // In an empty folder, because apt-get does not list files that the current folder already has.
        let empty = cache.temporary_folder()?;
        let mut command = self.command();
        command
            .args(["--print-uris", "download"])
            .args(names)
            .current_dir(empty.path());
        child::run(&mut command).map(|text| Package::parse_all(&text))
    }

    /// Returns the names of `request.with_dependencies` and of all their dependencies, without the packages
    /// that the system has.
    fn needed(&self, request: &Request) -> anyhow::Result<Vec<String>> {
        let mut plan = self.command();
        plan.args(["-o", "Dir::State::status=/dev/null"]);
        plan.args(["--no-install-recommends", "-y", "--print-uris", "install"]);
        let plan = child::run(plan.args(request.with_dependencies))?;
        let mut query = child::command("dpkg-query");
        query.args([
            "-W",
            "-f",
            "${db:Status-Status} ${Package}_${Version}_${Architecture}\n",
        ]);
        let here = child::run(&mut query)?;
        Ok(lacking(&plan, &here, request))
    }
}

/// Returns the names in apt-get's plan that dpkg's list of the system, `here`, lacks.
fn lacking(plan: &str, here: &str, request: &Request) -> Vec<String> {
    let here: HashSet<_> = here
        .lines()
        .filter_map(|line| line.strip_prefix("installed "))
        .collect();
    let files = plan.lines().filter_map(|line| {
        line.strip_prefix('\'')?
            .split_once("' ")?
            .1
            .split(' ')
            .next()
    });
    files
        .filter_map(|file| {
            let name = file.split('_').next()?;
            // apt-get escapes the colon of the version's epoch in file names.
            let package = file.strip_suffix(".deb")?.replace("%3a", ":");
            let forced = request.always.iter().any(|prefix| name.starts_with(prefix));
            let lacks = forced || !here.contains(package.as_str());
            let excluded =
                request.without_dependencies.contains(&name) || request.never.contains(&name);
            (lacks && !excluded).then(|| name.to_owned())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "'http://archive/pool/rustc-web_1.deb' rustc-web_1.96.0+dfsg1-1~deb12u2_amd64.deb 4450500 SHA256:8fef";

    #[test]
    fn packages_are_parsed_from_apt_gets_output_and_from_the_written_list() {
        let package = Package::parse(LINE).unwrap();
        assert_eq!(
            (package.name(), package.version()),
            ("rustc-web", "1.96.0+dfsg1-1~deb12u2")
        );
        assert_eq!(
            (package.bytes, package.sha256.as_str()),
            (4_450_500, "8fef")
        );
        assert_eq!(Package::parse(&package.to_string()), Some(package));
        let other = [
            "",
            "Reading package lists...",
            "'x' file",
            "'x' file 5 MD5Sum:00",
            "'x' file much SHA256:00",
        ];
        assert_eq!(Package::parse_all(&other.join("\n")), []);
    }

    #[test]
    fn only_packages_that_the_system_lacks_are_fetched() {
        let plan = "Reading package lists...\n\
            'http://a/libc6' libc6_2.36-9_amd64.deb 5 MD5Sum:00\n\
            'http://a/zlib1g' zlib1g_1%3a1.2.13_amd64.deb 5 MD5Sum:00\n\
            'http://a/libcap2' libcap2_1%3a2.66-4_amd64.deb 5 MD5Sum:00\n\
            'http://a/libgone' libgone_1_amd64.deb 5 MD5Sum:00\n\
            'http://a/qemu-x' qemu-x_1_all.deb 5 MD5Sum:00\n\
            'http://a/rustc' rustc_1_amd64.deb 5 MD5Sum:00\n";
        let here = "installed libc6_2.36-8_amd64\n\
            installed zlib1g_1:1.2.13_amd64\n\
            installed libcap2_1:2.66-4_i386\n\
            config-files libgone_1_amd64\n\
            installed qemu-x_1_all\n";
        let request = Request {
            what: "QEMU",
            without_dependencies: &["rustc"],
            with_dependencies: &[],
            always: &["qemu"],
            never: &["libc6"],
            suite: None,
            check: |_| Ok(()),
            room: |bytes| bytes,
        };
        assert_eq!(
            lacking(plan, here, &request),
            ["libcap2", "libgone", "qemu-x"]
        );
        let request = Request {
            never: &[],
            always: &[],
            ..request
        };
        assert_eq!(
            lacking(plan, here, &request),
            ["libc6", "libcap2", "libgone"]
        );
    }
}
