//! Finds out whether the user keeps cargo off the network.

use std::env;
use std::path::Path;

use super::settings;

/// The environment variable for cargo's setting `net.offline`.
const OFFLINE: &str = "CARGO_NET_OFFLINE";

/// Returns the setting by which the user keeps cargo off the network, if one exists.
pub fn offline() -> Option<String> {
    let folder = env::current_dir().unwrap_or_default();
    let home = settings::home();
    offline_by(env::var(OFFLINE).ok().as_deref(), &folder, home.as_deref())
}

/// Returns the setting by cargo's rules: the variable counts first, then the files from the current folder
/// upward, then cargo's home.
fn offline_by(variable: Option<&str>, folder: &Path, home: Option<&Path>) -> Option<String> {
    if let Some(value) = variable {
        return matches!(value, "true" | "1").then(|| OFFLINE.to_owned());
    }
    let mut files = settings::files(folder, home).into_iter();
    let (is_offline, file) = files.find_map(|file| Some((net_offline(&file)?, file)))?;
    is_offline.then(|| format!("net.offline in {}", file.display()))
}

fn net_offline(file: &Path) -> Option<bool> {
    settings::read(file).get("net")?.get("offline")?.as_bool()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_offline_setting_is_found_in_cargos_order() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        let (folder, home) = (at("up/down"), at("home"));
        for folder in ["up/.cargo", "up/down/.cargo", "home"] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        let by = |variable| offline_by(variable, &folder, Some(&home));
        let file = |name: &str| Some(format!("net.offline in {}", at(name).display()));
        assert_eq!(by(None), None);
        for value in ["true", "1"] {
            assert_eq!(by(Some(value)).as_deref(), Some(OFFLINE));
        }
        fs::write(at("home/config.toml"), "[net]\noffline = true").unwrap();
        assert_eq!(by(None), file("home/config.toml"));
        assert_eq!(by(Some("false")), None);
        assert_eq!(offline_by(None, &folder, None), None);
        // A nearer file that is broken, or does not set `net.offline`, changes nothing.
        for nothing in ["net.retry = 3", "[net", "net = 1", "net.offline = 1"] {
            fs::write(at("up/.cargo/config.toml"), nothing).unwrap();
            assert_eq!(by(None), file("home/config.toml"), "{nothing}");
        }
        fs::write(at("up/.cargo/config.toml"), "net.offline = false").unwrap();
        assert_eq!(by(None), None);
        fs::write(at("up/down/.cargo/config.toml"), "net = { offline = true }").unwrap();
        assert_eq!(by(None), file("up/down/.cargo/config.toml"));
        fs::write(at("up/down/.cargo/config"), "").unwrap();
        assert_eq!(by(None), None);
        fs::write(at("up/.cargo/config"), "net.offline = true").unwrap();
        assert_eq!(by(None), file("up/.cargo/config"));
    }
}
