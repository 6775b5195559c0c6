//! The finest clock available: the CPU's cycle counter on x86-64, the system's time elsewhere.

/// The unit of [`now`].
pub const UNIT: &str = if cfg!(target_arch = "x86_64") {
    "cycles"
} else {
    "ns"
};

/// Returns the time since a fixed point, in [`UNIT`]s.
#[cfg(target_arch = "x86_64")]
pub fn now() -> u64 {
    // SAFETY: every x86-64 has a time stamp counter, and Linux lets user programs read it.
    unsafe { std::arch::x86_64::_rdtsc() }
}

/// Returns the time since a fixed point, in [`UNIT`]s.
#[cfg(not(target_arch = "x86_64"))]
pub fn now() -> u64 {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_nanos() as u64
}

/// Returns the CPU's name, and those of its features that mappers may use.
pub fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = info.lines().find(|line| line.starts_with("model name"));
    let name = line.and_then(|line| line.split_once(": "));
    let name = name.map_or("unknown CPU", |(_, name)| name.trim());
    let mut features = Vec::new();
    #[cfg(target_arch = "x86_64")]
    for (has, feature) in [
        (is_x86_feature_detected!("bmi2"), "BMI2"),
        (is_x86_feature_detected!("avx2"), "AVX2"),
        (is_x86_feature_detected!("avx512f"), "AVX-512F"),
    ] {
        features.extend(has.then_some(feature));
    }
    match features.is_empty() {
        true => format!("{name}, {}", std::env::consts::ARCH),
        false => format!("{name}, with {}", features.join(", ")),
    }
}
