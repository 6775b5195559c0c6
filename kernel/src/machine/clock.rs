//! The time stamp counter, and times measured with it.

use core::arch::asm;
use core::arch::x86_64::{__cpuid, __cpuid_count};

use protocol::TICKS_PER_SECOND;

/// Returns the time stamp counter: the host's counter under plain TCG, and the number of instructions carried
/// out under `-icount shift=0`. The compiler moves no memory access across the call.
pub fn now() -> u64 {
    let (low, high): (u32, u32);
    // SAFETY: RDTSC changes two registers, and the kernel is allowed to execute it. Without `nomem` the
    // compiler must assume that the instruction accesses memory, which keeps other accesses in their place.
    unsafe {
        asm!("rdtsc", out("eax") low, out("edx") high, options(nostack, preserves_flags));
    }
    u64::from(high) << 32 | u64::from(low)
}

/// Measures time by the time stamp counter, and finds the counter's rate from the ticks that have passed.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    began: u64,
    tick: u32,
}

impl Stopwatch {
    /// Starts a stopwatch that compares the counter with the ticks from `tick` on.
    pub fn start(tick: u32) -> Self {
        Self { began: now(), tick }
    }

    /// Returns the microseconds since the counter was at `since`. The longer the stopwatch runs, the more
    /// exact the result is: within 2 % after a second.
    pub fn micros(&self, since: u64, tick: u32) -> u32 {
        let now = now();
        let ticks = tick.wrapping_sub(self.tick);
        let counted = now.saturating_sub(self.began).max(1);
        let passed = u128::from(ticks) * 1_000_000 / u128::from(TICKS_PER_SECOND);
        let micros = u128::from(now.saturating_sub(since)) * passed / u128::from(counted);
        micros.try_into().unwrap_or(u32::MAX)
    }
}

/// Carries out `count` instructions in a loop of two, plus a few around the loop, the same for every count.
#[inline(never)]
pub fn instructions(count: u32) {
    // SAFETY: the loop only counts its operand register down to zero.
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

/// Returns whether the CPU has BMI2, which includes the bit-extract instruction.
pub fn has_bmi2() -> bool {
    const EXTENDED_FEATURES: u32 = 7;
    const BMI2: u32 = 1 << 8;
    __cpuid(0).eax >= EXTENDED_FEATURES && __cpuid_count(EXTENDED_FEATURES, 0).ebx & BMI2 != 0
}
