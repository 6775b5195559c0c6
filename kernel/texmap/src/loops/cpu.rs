//! The CPU's features.

use core::arch::x86_64::{__cpuid, __cpuid_count};
use core::sync::atomic::{AtomicU8, Ordering};

/// Returns whether the CPU has BMI2, and with it PEXT. The first call stores the answer, because CPUID is
/// slow, above all under a hypervisor.
#[inline]
pub(super) fn has_extract() -> bool {
    const UNKNOWN: u8 = 0;
    const NO: u8 = 1;
    const YES: u8 = 2;
    static EXTRACT: AtomicU8 = AtomicU8::new(UNKNOWN);

    #[cold]
    fn ask() -> u8 {
        const FEATURES: u32 = 7;
        const BMI2: u32 = 1 << 8;
        let known = __cpuid(0).eax >= FEATURES;
        let answer = if known && __cpuid_count(FEATURES, 0).ebx & BMI2 != 0 {
            YES
        } else {
            NO
        };
        EXTRACT.store(answer, Ordering::Relaxed);
        answer
    }

    let known = match EXTRACT.load(Ordering::Relaxed) {
        UNKNOWN => ask(),
        known => known,
    };
    known == YES
}
