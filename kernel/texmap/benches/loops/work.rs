//! The measured work: columns of a texture at an angle, drawn into a page in RAM in two orders, and the bare
//! loop, which no loop can beat.

use modex::{Column, Destination, PlanarBuffer};
use texmap::{
    AffineStepper, Axis, Job, Loop, PlaneStepper, Rows, SpanKind, Style, Texture, Tolerance,
};

/// Columns of the frame.
pub const COLUMNS: u16 = 320;
/// Pixels in each column.
pub const LEN: u16 = 200;
/// Pixels of the frame.
pub const PIXELS: u32 = COLUMNS as u32 * LEN as u32;

/// Texels across and down the texture.
const SIDE: u16 = 128;

/// Returns the texture's texels.
pub fn texels() -> Vec<u8> {
    (0..u32::from(SIDE).pow(2))
        .map(|i| (i.wrapping_mul(0x9E37_79B1) >> 24) as u8)
        .collect()
}

/// Returns the texture.
pub fn texture(texels: &[u8]) -> Texture<'_> {
    Texture::padded(texels, SIDE, SIDE).expect("SIDE x SIDE texels")
}

/// Steps of 0.20 and 0.27 texel a pixel: the frame lies aslant in the texture and almost fills it.
const STEPS: (i32, i32) = (13_235, 17_695);

/// Returns the stepper down column `x`.
pub fn down(x: u16) -> AffineStepper {
    let (x, (du, dv)) = (i32::from(x), STEPS);
    AffineStepper {
        u: 0x1_0000 + x * dv,
        v: 0x1_8000 + (i32::from(COLUMNS) - x) * du,
        du,
        dv,
    }
}

/// Returns the stepper along row `y` of the same frame.
pub fn along(y: u16) -> AffineStepper {
    let (first, y, (du, dv)) = (down(0), i32::from(y), STEPS);
    AffineStepper {
        u: first.u + y * du,
        v: first.v + y * dv,
        du: dv,
        dv: -du,
    }
}

/// The order in which the columns are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// From left to right.
    X,
    /// All of plane 0, then of 1, 2 and 3.
    Planes,
}

impl Order {
    /// Returns the columns in this order.
    fn columns(self) -> impl Iterator<Item = u16> {
        let (planes, columns, step) = match self {
            Self::X => (1, COLUMNS, 1),
            Self::Planes => (4, COLUMNS / 4, 4),
        };
        (0..planes).flat_map(move |plane| (0..columns).map(move |i| plane + i * step))
    }
}

/// The way to draw the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// Loads a texel and stores it, and steps nothing.
    Bare,
    /// A loop for columns.
    Loop(Loop),
    /// Adaptive columns whose pieces all have this length, one of [`PIECES`].
    Pieces(u16),
    /// A quotient for every pixel of a column.
    Quotients,
    /// A mapper of rows, to which [`Order`] does not apply.
    Rows(Rows),
}

/// Draws the frame.
pub fn draw(page: &mut PlanarBuffer, texture: &Texture<'_>, by: By, order: Order) {
    match by {
        By::Bare => {
            for x in order.columns() {
                page.column(x, 0, LEN, |column| bare(texture.texels(), column));
            }
        }
        By::Loop(by) => {
            for x in order.columns() {
                page.column(x, 0, LEN, |column| by.column(texture, down(x), column));
            }
        }
        By::Pieces(length) => {
            let tolerance = tolerance(length);
            columns(page, texture, order, |x| {
                SpanKind::Adaptive(receding(x, 1, 13), tolerance)
            });
        }
        By::Quotients => columns(page, texture, order, |x| SpanKind::Exact(receding(x, 8, 8))),
        By::Rows(rows) => {
            let style = Style {
                rows,
                ..Style::default()
            };
            for y in 0..LEN {
                let row = Job {
                    axis: Axis::Right,
                    x: 0,
                    y,
                    len: COLUMNS,
                    texture: 0,
                    kind: SpanKind::Affine(along(y)),
                };
                row.draw(style, texture, page);
            }
        }
    }
}

/// Lengths of pieces that are timed.
pub const PIECES: [u16; 4] = [8, 16, 32, 64];

/// Returns the forms down column `x`. With every pixel, c falls by a part in 2^`shift` of its first value.
/// The texture coordinates begin with steps of 1 / `part` of the frame's.
fn receding(x: u16, part: i64, shift: u32) -> PlaneStepper {
    let depth = 1 << 44;
    let fall = -(depth >> shift);
    let AffineStepper { u, v, du, dv } = down(x);
    let form = |at: i32, step: i32| {
        let (at, step) = (i64::from(at), i64::from(step) / part);
        let whole = |n: i128| (n >> 16) as i64;
        let rise = i128::from(step) * i128::from(depth) + i128::from(at) * i128::from(fall);
        (whole(i128::from(at) * i128::from(depth)), whole(rise))
    };
    let (a, b) = (form(u, du), form(v, dv));
    PlaneStepper {
        at: [a.0, b.0, depth],
        step: [a.1, b.1, fall],
    }
}

/// Returns a tolerance to which pieces of `length` pixels keep, and longer pieces do not, everywhere in such
/// a column.
fn tolerance(length: u16) -> Tolerance {
    let length = u32::from(length);
    // The closed form, where the column begins; c falls by a fortieth, and the next length is 4/3.
    let error = STEPS.1 as u32 * length * length / (4 << 13);
    let units = error * 4 / 3 + length + 2;
    Tolerance::new(units, 1 << 16).expect("less than a texel")
}

/// Draws columns as a mapper in perspective does.
fn columns(
    page: &mut PlanarBuffer,
    texture: &Texture<'_>,
    order: Order,
    kind: impl Fn(u16) -> SpanKind,
) {
    let style = Style {
        affine: Loop::fastest(),
        ..Style::default()
    };
    for x in order.columns() {
        let job = Job {
            axis: Axis::Down,
            x,
            y: 0,
            len: LEN,
            texture: 0,
            kind: kind(x),
        };
        job.draw(style, texture, page);
    }
}

/// Loads and stores once for every pixel, 16 times unrolled: no loop can be faster.
///
/// # Panics
/// If `texels` does not have 16 texels.
pub fn bare(texels: &[u8], mut column: Column<'_>) {
    let texels = &texels[..16];
    let len = column.len();
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::asm;
        /// A block's loads and stores.
        macro_rules! block {
            ($($load:literal $store:literal),*) => {
                concat!($(
                    "movzx {texel:e}, byte ptr [{texels} + ", $load, "]\n",
                    "mov byte ptr [{dest} + ", $store, "], {texel:l}\n",
                )*)
            };
        }
        // SAFETY: the loads are inside the 16 texels; the stores are the column's pixels, as `Lane::new` was
        // promised. The stack is not used.
        unsafe {
            asm!(
                "jmp 3f",
                "2:",
                block!("0" "0"),
                "lea {dest}, [{dest} + 80]",
                "3:",
                "dec {odd:e}",
                "jnz 2b",
                "jmp 5f",
                "4:",
                block!(
                    "0" "0", "1" "80", "2" "160", "3" "240",
                    "4" "320", "5" "400", "6" "480", "7" "560",
                    "8" "640", "9" "720", "10" "800", "11" "880",
                    "12" "960", "13" "1040", "14" "1120", "15" "1200"
                ),
                "lea {dest}, [{dest} + 1280]",
                "5:",
                "dec {blocks:e}",
                "jnz 4b",
                dest = inout(reg) column.as_ptr() => _,
                odd = inout(reg) u32::from(len % 16) + 1 => _,
                blocks = inout(reg) u32::from(len / 16) + 1 => _,
                texels = in(reg) texels.as_ptr(),
                texel = out(reg) _,
                options(nostack),
            );
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        let _ = len;
        let mut texels = texels.iter().cycle();
        column.fill(|| texels.next().copied().unwrap_or_default());
    }
}
