//! The time stamp counter.

use core::arch::asm;
use core::arch::x86_64::{__cpuid, __cpuid_count};

use link::TICKS_PER_SECOND;

/// Ticks since the machine's start: the host's own under plain TCG, instructions carried out under
/// `-icount shift=0`. The compiler moves no memory access across it.
pub fn now() -> u64 {
    let (low, high): (u32, u32);
    // SAFETY: RDTSC changes two registers, and nothing forbids it to the kernel. That memory is not
    // said to be untouched is what keeps accesses in their place.
    unsafe {
        asm!("rdtsc", out("eax") low, out("edx") high, options(nostack, preserves_flags));
    }
    u64::from(high) << 32 | u64::from(low)
}

/// Tells how long something took: by the time stamp counter, and by the ticks that have passed, which
/// say how fast that counts.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    began: u64,
    tick: u32,
}

impl Stopwatch {
    /// Begins to compare the two.
    pub fn start(tick: u32) -> Self {
        Self { began: now(), tick }
    }

    /// The microseconds since the counter was at `since`. The longer ago the start, the more exact:
    /// after a second within 2 %.
    pub fn micros(&self, since: u64, tick: u32) -> u32 {
        let now = now();
        let ticks = tick.wrapping_sub(self.tick);
        let counted = now.saturating_sub(self.began).max(1);
        let passed = u128::from(ticks) * 1_000_000 / u128::from(TICKS_PER_SECOND);
        let micros = u128::from(now.saturating_sub(since)) * passed / u128::from(counted);
        micros.try_into().unwrap_or(u32::MAX)
    }
}

/// Carries out `count` instructions in a loop of two, and the same few around it for every count.
#[inline(never)]
pub fn instructions(count: u32) {
    // SAFETY: it counts a register of its own down to zero.
    unsafe {
        asm!(
            "2:",
            "sub {n:e}, 2",
            "ja 2b",
            n = inout(reg) count => _,
            options(nomem, nostack),
        );
    }
}

/// Whether the CPU has BMI2, with the bit-extract instruction.
pub fn has_bmi2() -> bool {
    const EXTENDED_FEATURES: u32 = 7;
    const BMI2: u32 = 1 << 8;
    __cpuid(0).eax >= EXTENDED_FEATURES && __cpuid_count(EXTENDED_FEATURES, 0).ebx & BMI2 != 0
}
