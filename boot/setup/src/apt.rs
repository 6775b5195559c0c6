//! Debian's packages, fetched and unpacked into the cache: no root, and nothing on the system changes.
//!
//! apt-get decides what a package needs. It plans as if the system were empty, because a plan for the real
//! system may fail or remove packages; what the system already has is then left out. apt-get never installs
//! anything here: it lists, and it downloads.

use std::collections::HashSet;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, anyhow, bail};
use tempfile::TempDir;

use super::cache::{self, Locked, is_full};
use super::offline::offline;
use super::sha256::sha256;
use system::{Interrupted, child};
use system::{Step, bytes};

/// The list of a folder's packages, in apt-get's words. It is written when all of them are there.
const LIST: &str = "list";

/// The machine's name in Debian's and Rust's paths alike.
pub const MACHINE: &str = std::env::consts::ARCH;

/// What apt-get does not do for us: the system's hooks, which change the system's caches when root runs them,
/// and indexes that nothing here reads.
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

/// What is wanted of the archive.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// What the packages are, for messages: `Rust 1.96.0`.
    pub what: &'a str,
    /// Packages without what they depend on.
    pub alone: &'a [&'a str],
    /// Packages with all that they depend on and this system does not have in the same version.
    pub whole: &'a [&'a str],
    /// Packages whose names begin so are fetched even where the system has them.
    pub own: &'a [&'a str],
    /// Packages that are left out even where the system has another version.
    pub never: &'a [&'a str],
    /// A suite of Debian to take them from, such as `bookworm-backports`; else the system's.
    pub suite: Option<&'a str>,
    /// Says why a package will not do.
    pub check: fn(&Package) -> anyhow::Result<()>,
    /// The bytes on the disk that are needed for `bytes` of packages.
    pub room: fn(bytes: u64) -> u64,
}

/// A package as `apt-get --print-uris download` lists it.
#[derive(Debug, PartialEq, Eq)]
pub struct Package {
    file: String,
    bytes: u64,
    sha256: String,
}

impl Package {
    /// Reads `'URI' FILE BYTES SHA256:HASH`.
    fn parse(line: &str) -> Option<Self> {
        let mut words = line.strip_prefix('\'')?.split_once("' ")?.1.split(' ');
        let (file, bytes) = (words.next()?.to_owned(), words.next()?.parse().ok()?);
        let sha256 = words.next()?.strip_prefix("SHA256:")?.to_owned();
        Some(Self {
            file,
            bytes,
            sha256,
        })
    }

    fn parse_all(text: &str) -> Vec<Self> {
        text.lines().filter_map(Self::parse).collect()
    }

    /// The package's name.
    pub fn name(&self) -> &str {
        self.file.split('_').next().unwrap_or_default()
    }

    /// The package's version, as its file name has it.
    pub fn version(&self) -> &str {
        self.file.split('_').nth(1).unwrap_or_default()
    }

    /// One of which only the file's name counts.
    #[cfg(test)]
    pub fn of_file(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            bytes: 0,
            sha256: String::new(),
        }
    }

    /// Whether a folder has it, whole and unchanged.
    fn is_in(&self, folder: &Path) -> bool {
        fs::read(folder.join(&self.file)).is_ok_and(|data| sha256(&data) == self.sha256)
    }
}

impl Display for Package {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "'' {} {} SHA256:{}", self.file, self.bytes, self.sha256)
    }
}

/// Whether this system has what is needed here.
pub fn is_here() -> bool {
    ["apt-get", "dpkg", "dpkg-query"]
        .map(which::which)
        .iter()
        .all(Result::is_ok)
}

/// The packages that an earlier [`fetch`] put into `folder`, if all are there and unchanged.
pub fn kept(folder: &Path) -> Option<Vec<Package>> {
    let list = Package::parse_all(&fs::read_to_string(folder.join(LIST)).ok()?);
    let whole = !list.is_empty() && missing(&list, folder).is_empty();
    whole.then_some(list)
}

/// Fetches packages into `folder`: by the system's package lists, or, where those are missing or old, by lists
/// of our own.
///
/// # Errors
/// When the archive does not have what is wanted, or does not deliver it whole.
pub fn fetch(cache: &Locked, wanted: &Wanted, folder: &Path) -> anyhow::Result<Vec<Package>> {
    if let Some(setting) = offline() {
        bail!("cargo is offline ({setting}), so nothing is downloaded");
    }
    if !is_here() {
        bail!("this is no Debian system (no apt-get and dpkg)");
    }
    let get = |apt: &Apt| {
        let list = apt.list(cache, wanted)?;
        download(cache, apt, wanted, list, folder)
    };
    // The system's lists know the system's suites only.
    if wanted.suite.is_none() {
        match get(&Apt::of_system(cache)?) {
            Err(error) if !error.is::<Interrupted>() && !is_full(&error) => {}
            done => return done,
        }
    }
    let apt = Apt::with_lists(cache, wanted.suite)?;
    let step = Step::new(
        "asking Debian's archive for its package lists, which are kept apart",
        0,
    );
    // Its exit code is that of its worst source: what counts is whether the packages are found afterwards.
    let updated = watch(apt.command().args(["--error-on=any", "update"]), step, || 0);
    match (get(&apt), updated) {
        (Err(error), Err(update)) if !error.is::<Interrupted>() && !is_full(&error) => {
            Err(anyhow!("{update:#}\n{error:#}"))
        }
        (done, _) => done,
    }
}

/// Unpacks packages of `folder` into the folder `into`, everything below its `usr`.
///
/// # Errors
/// When dpkg fails.
pub fn unpack(what: &str, packages: &[Package], folder: &Path, into: &Path) -> anyhow::Result<()> {
    let dpkg = which::which("dpkg").context("this is no Debian system (no dpkg)")?;
    let total = packages.iter().map(|package| package.bytes).sum();
    let mut step = Step::new(format_args!("unpacking {what}"), total);
    let mut done = 0;
    for package in packages {
        let mut unpack = child::family(&dpkg);
        unpack.arg("-x").arg(folder.join(&package.file)).arg(into);
        child::watch(&mut unpack, |event| step.on(event, || done))?;
        done += package.bytes;
        step.at(done);
    }
    // Older packages have files in `/lib` that belong to `/usr/lib`.
    for name in ["bin", "sbin", "lib", "lib64"] {
        let from = into.join(name);
        if from.is_dir() {
            merge(&from, &into.join("usr").join(name))?;
        }
    }
    Ok(())
}

/// Moves all that is in the folder `from` to `to`.
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

/// Runs a command as a step.
fn watch(command: &mut Command, mut step: Step, done: impl Fn() -> u64) -> anyhow::Result<String> {
    child::watch(command, |event| step.on(event, &done))
}

/// The packages of a list that are not in `folder` yet.
fn missing<'a>(list: &'a [Package], folder: &Path) -> Vec<&'a Package> {
    list.iter()
        .filter(|package| !package.is_in(folder))
        .collect()
}

/// Downloads what is not in `folder` yet, and notes there what it has.
fn download(
    cache: &Locked,
    apt: &Apt,
    wanted: &Wanted,
    list: Vec<Package>,
    folder: &Path,
) -> anyhow::Result<Vec<Package>> {
    let missing = missing(&list, folder);
    let sum = |packages: &[&Package]| packages.iter().map(|package| package.bytes).sum::<u64>();
    let total = sum(&missing);
    let all: Vec<_> = list.iter().collect();
    cache.room(total + (wanted.room)(sum(&all)), wanted.what)?;
    let aside = cache.aside()?;
    if !missing.is_empty() {
        let step = Step::new(
            format_args!(
                "downloading {} as {} Debian packages ({}), once",
                wanted.what,
                missing.len(),
                bytes(total)
            ),
            total,
        );
        let mut get = apt.command();
        get.arg("download")
            .args(missing.iter().map(|package| package.name()))
            .current_dir(aside.path());
        let got = watch(&mut get, step, || cache::size(aside.path()));
        fs::create_dir_all(folder)?;
        // Also after a failure: what is whole need not be fetched again.
        for package in missing.iter().filter(|package| package.is_in(aside.path())) {
            fs::rename(aside.path().join(&package.file), folder.join(&package.file))?;
        }
        got?;
    }
    if let Some(package) = missing.iter().find(|package| !package.is_in(folder)) {
        let (file, hash) = (&package.file, &package.sha256);
        bail!("{file} was cut short or changed on its way: its SHA-256 is not {hash}");
    }
    let text: String = list.iter().map(|package| format!("{package}\n")).collect();
    fs::write(aside.path().join(LIST), text)?;
    fs::rename(aside.path().join(LIST), folder.join(LIST))?;
    Ok(list)
}

/// apt-get, with the system's package lists or with lists of our own.
struct Apt<'a> {
    /// The configuration, and our own lists.
    folder: TempDir,
    own_lists: bool,
    suite: Option<&'a str>,
}

impl<'a> Apt<'a> {
    fn of_system(cache: &Locked) -> anyhow::Result<Self> {
        let folder = cache.aside()?;
        fs::write(folder.path().join("apt.conf"), CONFIGURATION)?;
        Ok(Self {
            folder,
            own_lists: false,
            suite: None,
        })
    }

    fn with_lists(cache: &Locked, suite: Option<&'a str>) -> anyhow::Result<Self> {
        let mut apt = Self {
            own_lists: true,
            ..Self::of_system(cache)?
        };
        // apt-get makes neither.
        for folder in ["lists/partial", "cache/archives/partial"] {
            fs::create_dir_all(apt.folder.path().join(folder))?;
        }
        if let Some(suite) = suite {
            apt.add_source(suite)?;
            apt.suite = Some(suite);
        }
        Ok(apt)
    }

    /// Makes a folder of sources: the system's, and this suite of the same archive.
    fn add_source(&self, suite: &str) -> anyhow::Result<()> {
        // apt-get lists what it would fetch: `'http://HOST/debian/dists/bookworm/InRelease' ...`.
        let mut ask = self.command();
        let known = child::run(ask.args(["--print-uris", "update"]))?;
        let archive = known
            .lines()
            .filter_map(|line| Some(line.strip_prefix('\'')?.split_once("/dists/")?.0))
            .find(|uri| uri.ends_with("/debian"))
            .context("this system has no source that is Debian's archive")?;
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
        // As root apt-get would download as another user, who cannot write to the cache, and warn about it.
        command
            .env("LC_ALL", "C")
            .args(["-q", "-o", "APT::Sandbox::User=root", "-c"])
            .arg(folder.join("apt.conf"));
        if !self.own_lists {
            // As root apt-get would rewrite its own index of the system's lists.
            for index in ["pkgcache", "srcpkgcache"] {
                command.args(["-o", &format!("Dir::Cache::{index}=")]);
            }
        }
        let mut place = |option: &str, name: &str| {
            let place = format!("{option}={}", folder.join(name).display());
            command.args(["-o", &place]);
        };
        if self.own_lists {
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

    /// The packages that are wanted, as far as this system does not have them.
    fn list(&self, cache: &Locked, wanted: &Wanted) -> anyhow::Result<Vec<Package>> {
        let alone = wanted.alone.iter().copied().map(str::to_owned);
        // Asked for alone: apt-get finds nothing at all if one name holds a version that the archive lacks.
        if let Some(first) = wanted.alone.first() {
            let first = [(*first).to_owned()];
            self.uris(cache, &first)?
                .iter()
                .try_for_each(wanted.check)?;
        }
        let names: Vec<_> = alone.chain(self.needed(wanted)?).collect();
        let list = self.uris(cache, &names)?;
        list.iter().try_for_each(wanted.check)?;
        match names
            .iter()
            .find(|name| !list.iter().any(|package| package.name() == *name))
        {
            Some(name) => bail!("apt-get does not say where to get {name}"),
            None => Ok(list),
        }
    }

    /// What the archive has for these names.
    fn uris(&self, cache: &Locked, names: &[String]) -> anyhow::Result<Vec<Package>> {
        // In an empty folder: it does not list what is there already.
        let empty = cache.aside()?;
        let mut command = self.command();
        command
            .args(["--print-uris", "download"])
            .args(names)
            .current_dir(empty.path());
        child::run(&mut command).map(|text| Package::parse_all(&text))
    }

    /// The names of the packages that are wanted whole, and of all that they need, without what the system has.
    fn needed(&self, wanted: &Wanted) -> anyhow::Result<Vec<String>> {
        let mut plan = self.command();
        plan.args(["-o", "Dir::State::status=/dev/null"]);
        plan.args(["--no-install-recommends", "-y", "--print-uris", "install"]);
        let plan = child::run(plan.args(wanted.whole))?;
        let mut ask = child::command("dpkg-query");
        ask.args([
            "-W",
            "-f",
            "${db:Status-Status} ${Package}_${Version}_${Architecture}\n",
        ]);
        let here = child::run(&mut ask)?;
        Ok(lacking(&plan, &here, wanted))
    }
}

/// The names in a plan of apt-get's, without those of dpkg's list of what is here.
fn lacking(plan: &str, here: &str, wanted: &Wanted) -> Vec<String> {
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
            // A file name cannot have the epoch's colon.
            let package = file.strip_suffix(".deb")?.replace("%3a", ":");
            let own = wanted.own.iter().any(|prefix| name.starts_with(prefix));
            let lacks = own || !here.contains(package.as_str());
            let again = wanted.alone.contains(&name) || wanted.never.contains(&name);
            (lacks && !again).then(|| name.to_owned())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "'http://archive/pool/rustc-web_1.deb' rustc-web_1.96.0+dfsg1-1~deb12u2_amd64.deb 4450500 SHA256:8fef";

    #[test]
    fn reads_what_apt_get_says_and_what_it_wrote_itself() {
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
    fn only_what_the_system_lacks_is_fetched() {
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
        let wanted = Wanted {
            what: "QEMU",
            alone: &["rustc"],
            whole: &[],
            own: &["qemu"],
            never: &["libc6"],
            suite: None,
            check: |_| Ok(()),
            room: |bytes| bytes,
        };
        assert_eq!(
            lacking(plan, here, &wanted),
            ["libcap2", "libgone", "qemu-x"]
        );
        let wanted = Wanted {
            never: &[],
            own: &[],
            ..wanted
        };
        assert_eq!(
            lacking(plan, here, &wanted),
            ["libc6", "libcap2", "libgone"]
        );
    }
}
