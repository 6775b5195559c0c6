//! The loops in x86-64 instructions. [`super::select`] explains why they may read without a check.
//!
//! All loops share a frame of code: blocks of [`BLOCK`] pixels, where each store has a constant offset
//! (chapter 58). The frame enters the first block in the middle, so that the pixels left fill whole blocks.
//! So one loop draws any height, a column of one pixel included, with a single jump that is hard to predict.
//! Nothing between pixels changes the carry flag (LEA steps the address, DEC counts), so a loop may keep a
//! carry in it. The fastest loops have a second frame, for pieces of columns whose pixels come in eights.
//!
//! Every function gets the first values of its registers in a type of [`super::registers`]. That type was
//! made from a stepper that stays in the texture, or has masks that do.

#![allow(unsafe_code)]

use core::arch::asm;
use core::arch::x86_64::_pext_u64;

use modex::{Column, STRIDE};

use super::cpu::has_extract;
use super::registers::{Address, Crossed, Halves, Joint, Pair, start};
use super::sink::PixelSink;
use super::stepper::AffineStepper;
use crate::geometry::Texture;

/// Pixels in a block.
const BLOCK: usize = 32;
const _: () = assert!(STRIDE == 80, "the offsets in `down` are multiples of 80");

/// The frame of code, for a column that is not empty. `$first` prepares the flags. `$pixel!(offset)` is one
/// pixel and its step: it stores to `{dest}` + offset, may use `{texel}` and `{spare}` freely, and uses the
/// operands that follow it.
macro_rules! down {
    ($column:ident, $first:literal, $pixel:ident, $($operands:tt)*) => {
        down!(
            @blocks $column, $first, $pixel, ($($operands)*)
            "20" "0", "21" "80", "22" "160", "23" "240",
            "24" "320", "25" "400", "26" "480", "27" "560",
            "28" "640", "29" "720", "30" "800", "31" "880",
            "32" "960", "33" "1040", "34" "1120", "35" "1200",
            "36" "1280", "37" "1360", "38" "1440", "39" "1520",
            "40" "1600", "41" "1680", "42" "1760", "43" "1840",
            "44" "1920", "45" "2000", "46" "2080", "47" "2160",
            "48" "2240", "49" "2320", "50" "2400", "51" "2480",
        )
    };
    (
        @blocks $column:ident, $first:literal, $pixel:ident, ($($operands:tt)*)
        $($label:literal $offset:literal),*,
    ) => {{
        let len = usize::from($column.len());
        // The number of the first block's pixels to skip, as if the column began above its top.
        let left_out = len.wrapping_neg() % BLOCK;
        let dest = $column.as_ptr().wrapping_sub(left_out * STRIDE);
        // SAFETY: the code stores to the first byte of the column and to every 80th after it, as many bytes
        // as the column has pixels: exactly what `Lane::new` was promised. `$pixel` reads texels only, by its
        // caller's argument. The stack is not used.
        unsafe {
            asm!(
                "lea {spare}, [rip + 8f]",
                "movsxd {texel}, dword ptr [{spare} + 4*{texel}]",
                "add {texel}, {spare}",
                $first,
                "jmp {texel}",
                ".p2align 2",
                "8:",
                $(concat!(".long ", $label, "f - 8b"),)*
                "9:",
                $(concat!($label, ":"), $pixel!($offset),)*
                "lea {dest}, [{dest} + {bytes}]",
                "dec {blocks:e}",
                "jnz 9b",
                dest = inout(reg) dest => _,
                bytes = const BLOCK * STRIDE,
                blocks = inout(reg) len.div_ceil(BLOCK) => _,
                texel = inout(reg_abcd) left_out => _,
                spare = out(reg) _,
                $($operands)*
                options(nostack),
            );
        }
    }};
}

/// The frame of code for the whole eights of a column. It has no entry in the middle, and does not draw the
/// pixels after the last whole eight.
macro_rules! eights {
    ($column:ident, "", $pixel:ident, $($operands:tt)*) => {{
        let blocks = u32::from($column.len() / 8);
        if blocks == 0 {
            return;
        }
        // SAFETY: as in `down`; the pixels after the last whole eight are not stored.
        unsafe {
            asm!(
                ".p2align 4",
                "2:",
                $pixel!("0"),
                $pixel!("80"),
                $pixel!("160"),
                $pixel!("240"),
                $pixel!("320"),
                $pixel!("400"),
                $pixel!("480"),
                $pixel!("560"),
                "lea {dest}, [{dest} + 640]",
                "dec {blocks:e}",
                "jnz 2b",
                dest = inout(reg) $column.as_ptr() => _,
                blocks = inout(reg) blocks => _,
                texel = out(reg_abcd) _,
                $($operands)*
                options(nostack),
            );
        }
    }};
}

/// Draws a column with an address and two fractions, and tests each carry.
#[inline(always)]
pub(super) fn two_carries(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
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
    let Some((start, mut column)) = start::<Address>(texture, stepper, column) else {
        return;
    };
    let texels = texture.texels().as_ptr();
    let at = texels.wrapping_add(start.at);
    let [carried, step] = start.steps;
    down!(column, "", pixel,
        at = inout(reg) at => _,
        u = inout(reg) start.u => _,
        v = inout(reg) start.v => _,
        du = in(reg) start.du,
        dv = in(reg) start.dv,
        step = in(reg) step,
        pitch = in(reg) carried - step,
    );
}

/// Draws a column with both fractions in one register. The upper fraction's carry leaves the register and is
/// added to the address; the lower fraction's carry goes to a bit that is tested.
#[inline(always)]
pub(super) fn packed(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
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
    let Some((start, mut column)) = start::<Halves>(texture, stepper, column) else {
        return;
    };
    let texels = texture.texels().as_ptr();
    let at = texels.wrapping_add(start.at);
    down!(column, "", pixel,
        at = inout(reg) at => _,
        fractions = inout(reg) start.fractions => _,
        step_fractions = in(reg) start.step_fractions,
        step = in(reg) start.step,
        pitch = in(reg) start.pitch,
        carry = const Halves::CARRY,
        clear = const !Halves::CARRY as i32,
    );
}

/// Draws a column with a table of two steps. SBB turns v's carry into 0 or -1, which selects the step; u's
/// carry is added along with it.
#[inline(always)]
pub(super) fn step_table(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
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
    let Some((start, mut column)) = start::<Address>(texture, stepper, column) else {
        return;
    };
    let texels = texture.texels().as_ptr();
    let at = texels.wrapping_add(start.at);
    // A copy: with a pointer into `start`, all of `start` would be in memory.
    let steps = start.steps;
    down!(column, "", pixel,
        at = inout(reg) at => _,
        u = inout(reg) start.u => _,
        v = inout(reg) start.v => _,
        du = in(reg) start.du,
        dv = in(reg) start.dv,
        steps = in(reg) steps.as_ptr(),
    );
}

/// Two accumulators, a mask for each, one shift.
macro_rules! shifts {
    ($frame:ident, $texture:ident, $stepper:ident, $column:ident, $($more:tt)*) => {
        macro_rules! pixel {
            ($offset:literal) => {
                concat!(
                    "mov {texel:e}, {v:e}\n",
                    "and {texel:e}, {v_mask:e}\n",
                    "mov {spare:e}, {u:e}\n",
                    "and {spare:e}, {u_mask:e}\n",
                    "or {texel:e}, {spare:e}\n",
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
        let Some((start, mut column)) = start::<Pair>($texture, $stepper, $column) else {
            return;
        };
        $frame!(column, "", pixel,
            texels = in(reg) $texture.texels().as_ptr(),
            u = inout(reg) start.u => _,
            v = inout(reg) start.v => _,
            du = in(reg) start.du,
            dv = in(reg) start.dv,
            u_mask = in(reg) start.u_mask,
            v_mask = in(reg) start.v_mask,
            $($more)*
        );
    };
}

#[inline(always)]
pub(super) fn shifts(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    shifts!(down, texture, stepper, column,);
}

/// Draws the whole eights of a column as `shifts` does.
#[inline(always)]
pub(crate) fn shifts_eights(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    shifts!(eights, texture, stepper, column, spare = out(reg) _,);
}

/// Draws a column with one accumulator and one mask; the row's bits are shifted down to the column's.
#[inline(always)]
pub(super) fn one_accumulator(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    macro_rules! pixel {
        ($offset:literal) => {
            concat!(
                "mov {texel}, {at}\n",
                "and {texel}, {mask}\n",
                "mov {spare}, {texel}\n",
                "shr {spare}, 32\n",
                "or {texel:e}, {spare:e}\n",
                "shr {texel:e}, 16\n",
                "movzx {texel:e}, byte ptr [{texels} + {texel}]\n",
                "mov byte ptr [{dest} + ",
                $offset,
                "], {texel:l}\n",
                "add {at}, {step}",
            )
        };
    }
    let Some((start, mut column)) = start::<Joint>(texture, stepper, column) else {
        return;
    };
    let texels = texture.texels().as_ptr();
    down!(column, "", pixel,
        texels = in(reg) texels,
        at = inout(reg) start.at => _,
        step = in(reg) start.step,
        mask = in(reg) start.mask,
    );
}

/// Draws a column with two registers that exchange their carries. Every shift changes the flags, so the row
/// is scaled by the scale of an address or by moving a byte, depending on the pitch.
#[inline(always)]
pub(super) fn add_carry(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    let Some((start, mut column)) = start::<Crossed>(texture, stepper, column) else {
        return;
    };
    let texels = texture.texels().as_ptr();
    macro_rules! crossed {
        ($($index:literal),+) => {{
            macro_rules! pixel {
                ($offset:literal) => {
                    concat!(
                        $($index, "\n",)+
                        "movzx {texel:e}, byte ptr [{texels} + {texel}]\n",
                        "mov byte ptr [{dest} + ",
                        $offset,
                        "], {texel:l}\n",
                        "adc {row}, {row_step}\n",
                        "adc {column}, {column_step}",
                    )
                };
            }
            down!(column, "bt {carry:e}, 0", pixel,
                texels = in(reg) texels,
                row = inout(reg_abcd) start.row => _,
                column = inout(reg) start.column => _,
                row_step = in(reg) start.row_step,
                column_step = in(reg) start.column_step,
                carry = in(reg) u32::from(start.carry),
            );
        }};
    }
    match start.columns {
        0 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{column} + {texel}]"
        ),
        1 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{column} + {texel}*2]"
        ),
        2 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{column} + {texel}*4]"
        ),
        3 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{column} + {texel}*8]"
        ),
        4 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{texel} + {texel}]",
            "lea {texel:e}, [{column} + {texel}*8]"
        ),
        5 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{texel}*4]",
            "lea {texel:e}, [{column} + {texel}*8]"
        ),
        6 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{texel}*8]",
            "lea {texel:e}, [{column} + {texel}*8]"
        ),
        7 => crossed!(
            "mov {texel:e}, {row:e}",
            "lea {texel:e}, [{texel} + {texel}]",
            "lea {texel:e}, [{texel}*8]",
            "lea {texel:e}, [{column} + {texel}*8]"
        ),
        _ => crossed!("mov {texel:e}, {column:e}", "mov {texel:h}, {row:l}"),
    }
}

/// One accumulator, and an instruction that gathers the bits of the index. The CPU must have this
/// instruction.
macro_rules! extract {
    ($frame:ident, $texture:ident, $stepper:ident, $column:ident) => {
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
        let Some((start, mut column)) = start::<Joint>($texture, $stepper, $column) else {
            return;
        };
        $frame!(column, "", pixel,
            texels = in(reg) $texture.texels().as_ptr(),
            at = inout(reg) start.at => _,
            step = in(reg) start.step,
            mask = in(reg) start.mask,
        );
    };
}

#[inline(always)]
pub(super) fn extract(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    extract!(down, texture, stepper, column);
}

/// Draws the whole eights of a column as `extract` does.
#[inline(always)]
pub(crate) fn extract_eights(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    extract!(eights, texture, stepper, column);
}

/// Writes the texels of a row as `extract` does. The CPU must have BMI2.
#[inline(always)]
pub(super) fn fill_row(texels: &[u8], joint: Joint, sink: impl PixelSink) {
    /// Fills `sink`. This function and the loop inside `sink` are compiled for a CPU with BMI2.
    #[target_feature(enable = "bmi2")]
    fn extract(texels: &[u8], joint: Joint, sink: impl PixelSink) {
        let Joint { mut at, step, mask } = joint;
        sink.fill(|| {
            let index = _pext_u64(at, mask) as usize;
            at = at.wrapping_add(step);
            // SAFETY: the mask addresses exactly the texture's texels, so the index is in bounds.
            unsafe { *texels.get_unchecked(index) }
        });
    }
    debug_assert!(has_extract());
    // SAFETY: the caller guarantees that the CPU has BMI2.
    unsafe { extract(texels, joint, sink) }
}
