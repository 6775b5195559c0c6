//! The loops in x86-64 instructions. Why they may read without a check is told in [`super`].
//!
//! One frame serves all: blocks of [`BLOCK`] pixels, each store at a constant offset (chapter 58).
//! The first is entered where as many are left as do not fill blocks. One loop so draws any height,
//! a column of one pixel included, with one jump that is hard to foresee. Nothing between pixels
//! changes the carry flag (LEA steps the address, DEC counts): a loop may keep it.
//!
//! Every function gets its registers' first values in a type of [`super::steps`], which was made
//! of a walk that stays in the texture, or has masks that do.

#![allow(unsafe_code)]

use core::arch::asm;
use core::arch::x86_64::{__cpuid, __cpuid_count};
use core::sync::atomic::{AtomicU8, Ordering};

use modex::{Column, STRIDE};

use super::steps::{Address, Crossed, Halves, Joint, Pair};

/// Pixels in a block.
const BLOCK: usize = 16;
const _: () = assert!(STRIDE == 80, "the offsets in `down` are multiples of 80");

/// The frame, for a column that is not empty. `$first` prepares the flags; `$pixel!(offset)` is one
/// pixel and its step: it stores to `{dest}` + offset, and uses what the operands after it name.
macro_rules! down {
    ($column:ident, $first:literal, $pixel:ident, $($operands:tt)*) => {{
        let len = usize::from($column.len());
        // So many pixels of the first block are left out, as if the column began above its top.
        let left_out = len.wrapping_neg() % BLOCK;
        let dest = $column.as_ptr().wrapping_sub(left_out * STRIDE);
        // SAFETY: the frame stores to the first byte of the column and to every 80th after it, as
        // many as it has pixels: what `Lane::new` was promised. What `$pixel` reads are texels,
        // by its caller's argument. The stack is not used.
        unsafe {
            asm!(
                "lea {entries}, [rip + 8f]",
                "movsxd {entry}, dword ptr [{entries} + 4*{entry}]",
                "add {entry}, {entries}",
                $first,
                "jmp {entry}",
                ".p2align 2",
                "8:",
                ".long 20f - 8b",
                ".long 21f - 8b",
                ".long 22f - 8b",
                ".long 23f - 8b",
                ".long 24f - 8b",
                ".long 25f - 8b",
                ".long 26f - 8b",
                ".long 27f - 8b",
                ".long 28f - 8b",
                ".long 29f - 8b",
                ".long 30f - 8b",
                ".long 31f - 8b",
                ".long 32f - 8b",
                ".long 33f - 8b",
                ".long 34f - 8b",
                ".long 35f - 8b",
                "20:",
                $pixel!("0"),
                "21:",
                $pixel!("80"),
                "22:",
                $pixel!("160"),
                "23:",
                $pixel!("240"),
                "24:",
                $pixel!("320"),
                "25:",
                $pixel!("400"),
                "26:",
                $pixel!("480"),
                "27:",
                $pixel!("560"),
                "28:",
                $pixel!("640"),
                "29:",
                $pixel!("720"),
                "30:",
                $pixel!("800"),
                "31:",
                $pixel!("880"),
                "32:",
                $pixel!("960"),
                "33:",
                $pixel!("1040"),
                "34:",
                $pixel!("1120"),
                "35:",
                $pixel!("1200"),
                "lea {dest}, [{dest} + 1280]",
                "dec {blocks:e}",
                "jnz 20b",
                dest = inout(reg) dest => _,
                blocks = inout(reg) len.div_ceil(BLOCK) => _,
                entry = inout(reg) left_out => _,
                entries = out(reg) _,
                $($operands)*
                options(nostack),
            );
        }
    }};
}

/// The address and two fractions, each carry tested.
#[inline]
pub(super) fn two_carries(start: Address<'_>, mut column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "movzx {texel:e}, byte ptr [{at}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {at}, {step}\n",
                "add {u:e}, {du:e}\n",
                "jnc 6f\n",
                "inc {at}\n",
                "6:\n",
                "add {v:e}, {dv:e}\n",
                "jnc 7f\n",
                "add {at}, {pitch}\n",
                "7:",
            )
        };
    }
    debug_assert_eq!(start.len, column.len());
    let at = start.texels.as_ptr().wrapping_add(start.at);
    let [carried, step] = start.steps;
    down!(column, "", pixel,
        at = inout(reg) at => _,
        u = inout(reg) start.u => _,
        v = inout(reg) start.v => _,
        du = in(reg) start.du,
        dv = in(reg) start.dv,
        step = in(reg) step,
        pitch = in(reg) carried - step,
        texel = out(reg) _,
    );
}

/// Both fractions in one register: the carry of the upper goes out of it into the address, the
/// lower's into a bit that is tested.
#[inline]
pub(super) fn packed(start: Halves<'_>, mut column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "movzx {texel:e}, byte ptr [{at}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {fractions:e}, {step_fractions:e}\n",
                "adc {at}, {step}\n",
                "test {fractions:e}, {carry}\n",
                "jz 6f\n",
                "add {at}, {pitch}\n",
                "and {fractions:e}, {clear}\n",
                "6:",
            )
        };
    }
    debug_assert_eq!(start.len, column.len());
    let at = start.texels.as_ptr().wrapping_add(start.at);
    down!(column, "", pixel,
        at = inout(reg) at => _,
        fractions = inout(reg) start.fractions => _,
        step_fractions = in(reg) start.step_fractions,
        step = in(reg) start.step,
        pitch = in(reg) start.pitch,
        texel = out(reg) _,
        carry = const Halves::CARRY,
        clear = const !Halves::CARRY as i32,
    );
}

/// SBB makes 0 or -1 of v's carry, which picks the step; u's carry goes in with it.
#[inline]
pub(super) fn two_steps(start: Address<'_>, mut column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "movzx {texel:e}, byte ptr [{at}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {v:e}, {dv:e}\n",
                "sbb {texel}, {texel}\n",
                "add {u:e}, {du:e}\n",
                "adc {at}, qword ptr [{steps} + {texel}*8 + 8]",
            )
        };
    }
    debug_assert_eq!(start.len, column.len());
    let at = start.texels.as_ptr().wrapping_add(start.at);
    down!(column, "", pixel,
        at = inout(reg) at => _,
        u = inout(reg) start.u => _,
        v = inout(reg) start.v => _,
        du = in(reg) start.du,
        dv = in(reg) start.dv,
        steps = in(reg) start.steps.as_ptr(),
        texel = out(reg) _,
    );
}

/// Two accumulators, a mask for each, one shift.
#[inline]
pub(super) fn shifts(start: Pair<'_>, mut column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "mov {texel:e}, {v:e}\n",
                "and {texel:e}, {v_mask:e}\n",
                "mov {columns:e}, {u:e}\n",
                "and {columns:e}, {u_mask:e}\n",
                "or {texel:e}, {columns:e}\n",
                "shr {texel:e}, 16\n",
                "movzx {texel:e}, byte ptr [{texels} + {texel}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {u:e}, {du:e}\n",
                "add {v:e}, {dv:e}",
            )
        };
    }
    down!(column, "", pixel,
        texels = in(reg) start.texels.as_ptr(),
        u = inout(reg) start.u => _,
        v = inout(reg) start.v => _,
        du = in(reg) start.du,
        dv = in(reg) start.dv,
        u_mask = in(reg) start.u_mask,
        v_mask = in(reg) start.v_mask,
        texel = out(reg) _,
        columns = out(reg) _,
    );
}

/// One accumulator and one mask, the row's bits shifted down to the column's.
#[inline]
pub(super) fn joined(start: Joint<'_>, mut column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "mov {texel}, {at}\n",
                "and {texel}, {mask}\n",
                "mov {rows}, {texel}\n",
                "shr {rows}, 32\n",
                "or {texel:e}, {rows:e}\n",
                "shr {texel:e}, 16\n",
                "movzx {texel:e}, byte ptr [{texels} + {texel}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {at}, {step}",
            )
        };
    }
    down!(column, "", pixel,
        texels = in(reg) start.texels.as_ptr(),
        at = inout(reg) start.at => _,
        step = in(reg) start.step,
        mask = in(reg) start.mask,
        texel = out(reg) _,
        rows = out(reg) _,
    );
}

/// The two registers cross their carries. How the row is scaled depends on the pitch, because no
/// shift leaves the flags alone: by the scale of addresses, or by moving a byte.
#[inline]
pub(super) fn add_carry(start: Crossed<'_>, column: Column<'_>) {
    macro_rules! crossed {
        ($($index:literal),+) => {{
            macro_rules! pixel {
                ($offset:literal) => {
                    concat!(
                        $($index, "\n",)+
                        "movzx eax, byte ptr [{texels} + rax]\n",
                        "mov byte ptr [{dest} + ",
                        $offset,
                        "], al\n",
                        "adc rdx, {row_step}\n",
                        "adc {column}, {column_step}",
                    )
                };
            }
            let mut lane = column;
            debug_assert_eq!(start.len, lane.len());
            down!(lane, "bt {carry:e}, 0", pixel,
                texels = in(reg) start.texels.as_ptr(),
                inout("rdx") start.row => _,
                column = inout(reg) start.column => _,
                row_step = in(reg) start.row_step,
                column_step = in(reg) start.column_step,
                carry = in(reg) u32::from(start.carry),
                out("rax") _,
            );
        }};
    }
    match start.columns {
        0 => crossed!("mov eax, edx", "lea eax, [{column} + rax]"),
        1 => crossed!("mov eax, edx", "lea eax, [{column} + rax*2]"),
        2 => crossed!("mov eax, edx", "lea eax, [{column} + rax*4]"),
        3 => crossed!("mov eax, edx", "lea eax, [{column} + rax*8]"),
        4 => crossed!(
            "mov eax, edx",
            "lea eax, [rax + rax]",
            "lea eax, [{column} + rax*8]"
        ),
        5 => crossed!(
            "mov eax, edx",
            "lea eax, [rax*4]",
            "lea eax, [{column} + rax*8]"
        ),
        6 => crossed!(
            "mov eax, edx",
            "lea eax, [rax*8]",
            "lea eax, [{column} + rax*8]"
        ),
        7 => crossed!(
            "mov eax, edx",
            "lea eax, [rax + rax]",
            "lea eax, [rax*8]",
            "lea eax, [{column} + rax*8]"
        ),
        _ => crossed!("mov eax, {column:e}", "mov ah, dl"),
    }
}

/// One accumulator, and an instruction that gathers the bits of the index. The CPU must have it.
#[inline]
pub(super) fn extract(start: Joint<'_>, mut column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "pext {texel}, {at}, {mask}\n",
                "movzx {texel:e}, byte ptr [{texels} + {texel}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {at}, {step}",
            )
        };
    }
    down!(column, "", pixel,
        texels = in(reg) start.texels.as_ptr(),
        at = inout(reg) start.at => _,
        step = in(reg) start.step,
        mask = in(reg) start.mask,
        texel = out(reg) _,
    );
}

/// Whether the CPU has BMI2, and with it PEXT. Asked once: CPUID is slow, under a hypervisor most
/// of all.
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
