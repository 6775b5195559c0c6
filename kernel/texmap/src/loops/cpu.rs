//! The CPU's features.

use core::arch::x86_64::{__cpuid, __cpuid_count};
use core::sync::atomic::{AtomicU32, Ordering};

const BMI2: u32 = 1 << 8;
const AVX2: u32 = 1 << 5;
/// AVX-512 F, DQ and VL.
const AVX512: u32 = 1 << 16 | 1 << 17 | 1 << 31;

/// Returns whether the CPU has BMI2, and with it PEXT.
#[inline]
pub(super) fn has_extract() -> bool {
    features() & BMI2 != 0
}

/// Returns whether the CPU has AVX2 and the operating system saves its registers.
#[cfg(not(target_os = "none"))]
pub(super) fn has_avx2() -> bool {
    features() & AVX2 != 0
}

/// Returns whether the CPU has AVX-512 F, DQ and VL, and the operating system saves their registers.
#[cfg(not(target_os = "none"))]
pub(super) fn has_avx512() -> bool {
    features() & AVX512 == AVX512
}

/// Returns EBX of CPUID's leaf 7, the features, or zero for a CPU without this leaf. Features whose
/// registers the operating system does not save are left out. The first call stores the answer, because
/// CPUID is slow, above all under a hypervisor.
#[inline]
fn features() -> u32 {
    /// No answer: an answer is only made of the features that are named here.
    const UNKNOWN: u32 = u32::MAX;
    static FEATURES: AtomicU32 = AtomicU32::new(UNKNOWN);

    #[cold]
    fn ask() -> u32 {
        const LEAF: u32 = 7;
        /// XCR0's bits for the registers of AVX, and of AVX-512.
        const AVX_STATE: u64 = 0b110;
        const AVX512_STATE: u64 = 0b1110_0110;
        let mut answer = 0;
        if __cpuid(0).eax >= LEAF {
            let saved = saved_state();
            answer = __cpuid_count(LEAF, 0).ebx & (BMI2 | AVX2 | AVX512);
            if saved & AVX_STATE != AVX_STATE {
                answer &= !AVX2;
            }
            if saved & AVX512_STATE != AVX512_STATE {
                answer &= !AVX512;
            }
        }
        FEATURES.store(answer, Ordering::Relaxed);
        answer
    }

    match FEATURES.load(Ordering::Relaxed) {
        UNKNOWN => ask(),
        known => known,
    }
}

/// Returns XCR0, the parts of the CPU's extended state that the operating system saves, or zero if it has
/// enabled none.
#[allow(unsafe_code)]
fn saved_state() -> u64 {
    const OSXSAVE: u32 = 1 << 27;
    if __cpuid(1).ecx & OSXSAVE == 0 {
        return 0;
    }
    let (low, high): (u32, u32);
    // SAFETY: OSXSAVE says that XGETBV is enabled, and XCR0 exists wherever XGETBV does.
    unsafe {
        core::arch::asm!(
            "xgetbv",
            in("ecx") 0,
            out("eax") low,
            out("edx") high,
            options(nomem, nostack, preserves_flags),
        );
    }
    u64::from(high) << 32 | u64::from(low)
}
