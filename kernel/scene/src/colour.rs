//! The palette, the light table and the background.
//!
//! 208 colours are 6 ramps of [`SHADES`] from dark to bright: what a texture may use. The light
//! table moves a colour along its ramp. The rest belongs to the background.

use modex::{HEIGHT, Palette};

use crate::Vec3;

/// Light levels, from the dark side to the highlight.
pub const LIGHT_LEVELS: usize = 32;
/// What each colour becomes at each light level.
pub type LightTable = [[u8; 256]; LIGHT_LEVELS];
/// Shades of a ramp.
pub const SHADES: usize = 32;
/// Ramps.
pub const RAMPS: usize = 6;
/// The DAC's colours.
pub static PALETTE: Palette = palette();
/// The light table of [`PALETTE`].
pub static LIGHT_TABLE: LightTable = light_table();
/// The colour of each scan line behind the solid.
pub static BACKGROUND: [u8; HEIGHT] = background();

const fn palette() -> Palette {
    let mut palette = [[0; 3]; 256];
    let full = [
        [63, 50, 20],
        [63, 60, 50],
        [20, 24, 60],
        [48, 20, 60],
        [16, 50, 52],
        [60, 16, 20],
    ];
    let mut i = 0;
    while i < RAMPS * SHADES {
        let mut k = 0;
        while k < 3 {
            palette[i][k] = (full[i / SHADES][k] * (i % SHADES) / (SHADES - 1)) as u8;
            k += 1;
        }
        i += 1;
    }
    while i < 256 {
        palette[i] = [0, 0, ((i - RAMPS * SHADES) / 3) as u8];
        i += 1;
    }
    palette
}

const fn light_table() -> LightTable {
    let mut table = [[0; 256]; LIGHT_LEVELS];
    let mut level = 0;
    while level < LIGHT_LEVELS {
        let mut colour = 0;
        while colour < 256 {
            table[level][colour] = if colour < RAMPS * SHADES {
                let (ramp, shade) = (colour / SHADES, colour % SHADES);
                (ramp * SHADES + shade * (level + 1) / LIGHT_LEVELS) as u8
            } else {
                colour as u8
            };
            colour += 1;
        }
        level += 1;
    }
    table
}

const fn background() -> [u8; HEIGHT] {
    let mut lines = [0; HEIGHT];
    let mut y = 0;
    while y < HEIGHT {
        lines[y] = (RAMPS * SHADES + y * (256 - RAMPS * SHADES) / HEIGHT) as u8;
        y += 1;
    }
    lines
}

/// The light level of a face whose outward normal in the viewer's space is `normal`, 14
/// fraction bits.
pub fn lit_level(normal: Vec3) -> usize {
    let towards_light = [-7600, -9000, -11000];
    let dot: i64 = (0..3)
        .map(|k| i64::from(normal[k]) * towards_light[k])
        .sum();
    let level = 4 + dot * 27 / (1 << 28);
    level.clamp(0, LIGHT_LEVELS as i64 - 1) as usize
}
