//! The palette, the light table and the background.
//!
//! # Why ramps
//! 256 colours have to serve every hue in every light. A search for the entry nearest to each lit colour
//! would jump between hues from one facet to the next. So the palette consists of [`RAMPS`] ramps, each one a
//! material from night to glint, and light only ever moves a colour *along its ramp*. A texture names a ramp
//! and a shade, and may use no other colour.
//!
//! # Why the hue shifts
//! A shadow is not the colour times a half: the night sky lights whatever faces away from the lamp. All ramps
//! therefore begin in the same night blue and end near the white of the lamp, and show the material's own hue
//! only in between. The dark side of seven materials merges into one dusk, and a highlight looks like a
//! reflection instead of a brighter paint.
//!
//! # Why a table
//! A facet has one light level, so a whole texture is run through one row of [`LIGHT_TABLE`] when the scene
//! is set, and drawing costs no more. The same row first dims (diffuse light) and then adds (the highlight),
//! which no product could do.
//!
//! # The background
//! The background is a function of the scan line alone: dusk over a sea. Between two neighbouring colours the
//! lines alternate, so that no step of the 6-bit DAC is visible as an edge.

use core::ops::Range;

use modex::{HEIGHT, Palette, Rgb6};

use crate::Vec3;

/// Light levels, from the dark side to the highlight.
pub const LIGHT_LEVELS: usize = 24;
/// The lit colour of each colour at each light level.
pub type LightTable = [[u8; 256]; LIGHT_LEVELS];

/// The DAC's colours.
pub static PALETTE: Palette = palette();
/// The light table of [`PALETTE`].
pub static LIGHT_TABLE: LightTable = light_table();
/// The colour of each scan line behind the solid.
pub static BACKGROUND: [u8; HEIGHT] = background(HORIZON);
/// The same background with the horizon at eye level, for scenes with a floor or a wall.
pub static LEVEL_BACKGROUND: [u8; HEIGHT] = background(HEIGHT / 2);

/// Black: entry 0, which the overscan shows.
const BLACK: u8 = 0;
/// For text over the frame: bright, and not changed by light.
pub const WHITE: u8 = 1;
/// For emphasis in the text.
pub const YELLOW: u8 = 2;

/// First colour of the ramps.
const FIRST_SHADE: usize = 3;
/// Shades of a ramp: six steps from one anchor to the next.
pub const SHADES: usize = 25;
/// Ramps of the palette.
pub const RAMPS: usize = 7;

/// A material: its ramp in the palette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// Enamel, between [`Ramp::Rose`] and [`Ramp::Indigo`]: neighbours differ little, so that clouds may pass
    /// from one to the next.
    Violet,
    /// Enamel, the colour of the night.
    Indigo,
    /// Enamel, between [`Ramp::Indigo`] and [`Ramp::Teal`].
    Azure,
    /// Enamel, the cold end.
    Teal,
    /// Enamel, the warm end.
    Rose,
    /// Metal: its shadows are red, not grey.
    Gold,
    /// Stars and silver.
    Pearl,
}

impl Ramp {
    /// Returns the colour at a shade below [`SHADES`]. Textures should leave the upper quarter to the
    /// highlight.
    pub const fn shade(self, shade: usize) -> u8 {
        (FIRST_SHADE + self as usize * SHADES + shade) as u8
    }
}

/// Each ramp's night, shadow, body, light and glint. At the same shade all enamels are about equally bright,
/// so that only the hue changes where two of them meet.
#[rustfmt::skip]
const ANCHORS: [[Rgb6; 5]; RAMPS] = [
    [[ 2,  1,  7], [13,  4, 25], [32, 11, 46], [50, 34, 61], [63, 58, 63]], // violet
    [[ 1,  1,  7], [ 6,  7, 26], [15, 19, 48], [34, 41, 62], [59, 60, 63]], // indigo
    [[ 1,  2,  7], [ 3, 10, 25], [ 8, 27, 49], [27, 48, 62], [58, 62, 63]], // azure
    [[ 1,  2,  7], [ 2, 13, 22], [ 5, 34, 39], [26, 54, 53], [58, 63, 62]], // teal
    [[ 3,  1,  7], [21,  4, 22], [48, 11, 36], [61, 35, 47], [63, 58, 60]], // rose
    [[ 4,  2,  7], [21,  9, 10], [46, 28,  8], [62, 51, 20], [63, 63, 55]], // gold
    [[ 4,  4, 10], [17, 17, 30], [38, 38, 49], [56, 54, 55], [63, 63, 63]], // pearl
];

/// First colour of the sky, at the zenith; its last colour is at the horizon.
const FIRST_SKY: usize = FIRST_SHADE + RAMPS * SHADES;
/// The entries that neither a background nor text uses: a loaded model puts its own colours there.
pub const MATERIALS: Range<usize> = FIRST_SHADE..FIRST_SKY;
/// Colours of the sky: enough that two neighbouring lines differ by at most 4 of the DAC's 63 steps.
const SKY: usize = 52;
/// First colour of the sea, in the deep; its last colour is the glitter below the horizon.
const FIRST_SEA: usize = FIRST_SKY + SKY;
/// Colours of the sea.
const SEA: usize = 256 - FIRST_SEA;

/// Dusk: half the sky is night, so that the lit side of the ball stands out. The glow is low and behind the
/// ball's dark side.
const ZENITH_TO_HORIZON: [Rgb6; 9] = [
    [1, 1, 6],
    [2, 2, 10],
    [3, 4, 14],
    [5, 5, 18],
    [9, 7, 23],
    [15, 9, 27],
    [25, 14, 31],
    [40, 22, 32],
    [60, 42, 34],
];
/// The sea reflects the sky upside down, and dimmer.
const DEEP_TO_GLITTER: [Rgb6; 5] = [
    [2, 2, 9],
    [6, 5, 17],
    [14, 9, 25],
    [29, 16, 28],
    [52, 34, 32],
];

const fn palette() -> Palette {
    let mut palette = [[0; 3]; 256];
    palette[BLACK as usize] = [0, 0, 0];
    palette[WHITE as usize] = [63, 63, 63];
    palette[YELLOW as usize] = [63, 58, 24];
    let mut ramp = 0;
    while ramp < RAMPS {
        blend(
            &mut palette,
            FIRST_SHADE + ramp * SHADES,
            SHADES,
            &ANCHORS[ramp],
        );
        ramp += 1;
    }
    blend(&mut palette, FIRST_SKY, SKY, &ZENITH_TO_HORIZON);
    blend(&mut palette, FIRST_SEA, SEA, &DEEP_TO_GLITTER);
    palette
}

/// Fills `count` entries from `first` on with colours spaced evenly along `anchors`.
const fn blend(palette: &mut Palette, first: usize, count: usize, anchors: &[Rgb6]) {
    let (steps, spans) = (count - 1, anchors.len() - 1);
    let mut i = 0;
    while i < count {
        // The last colour ends the last span and does not begin another.
        let span = if i == steps {
            spans - 1
        } else {
            i * spans / steps
        };
        let within = i * spans - span * steps;
        let mut k = 0;
        while k < 3 {
            let (a, b) = (anchors[span][k] as usize, anchors[span + 1][k] as usize);
            palette[first + i][k] = ((a * (steps - within) + b * within + steps / 2) / steps) as u8;
            k += 1;
        }
        i += 1;
    }
}

/// The level at which a texture has the colours it was painted in. Lower levels dim it; higher levels add the
/// highlight.
pub const FULL_LIGHT: usize = 17;
/// Ambient light, in levels: keeps the dark side from black.
pub const AMBIENT: usize = 4;
/// Half shades that each level of highlight adds: enough to bring enamel half-way to white, and metal nearly
/// to white.
const SHINE: [usize; RAMPS] = [3, 3, 3, 3, 3, 4, 3];

const fn light_table() -> LightTable {
    let mut table = [[0; 256]; LIGHT_LEVELS];
    let mut level = 0;
    while level < LIGHT_LEVELS {
        let mut colour = 0;
        while colour < 256 {
            // Neither the background nor text is lit.
            table[level][colour] = colour as u8;
            colour += 1;
        }
        let mut i = 0;
        while i < RAMPS * SHADES {
            let (ramp, shade) = (i / SHADES, i % SHADES);
            let light = if level < FULL_LIGHT {
                level
            } else {
                FULL_LIGHT
            };
            let full = FULL_LIGHT + AMBIENT;
            let diffuse = (shade * (light + AMBIENT) + full / 2) / full;
            let lit = diffuse + (level - light) * SHINE[ramp] / 2;
            let lit = if lit < SHADES { lit } else { SHADES - 1 };
            table[level][FIRST_SHADE + i] = (FIRST_SHADE + ramp * SHADES + lit) as u8;
            i += 1;
        }
        level += 1;
    }
    table
}

/// First line of the sea: below the ball's centre, so that the glow is behind its dark side.
const HORIZON: usize = 178;

const fn background(horizon: usize) -> [u8; HEIGHT] {
    let mut lines = [0; HEIGHT];
    // Eighths that are added to a line's position between two colours before it is rounded down. Any eight
    // lines in a row use all of them, and neighbours differ widely.
    let thresholds = [0, 4, 2, 6, 1, 5, 3, 7];
    let mut y = 0;
    while y < horizon {
        let eighths = y * (SKY - 1) * 8 / (horizon - 1);
        lines[y] = (FIRST_SKY + (eighths + thresholds[y % 8]) / 8) as u8;
        y += 1;
    }
    // The horizon has the last colour; no threshold, at most 7/8, moves it to the next.
    assert!(lines[horizon - 1] as usize == FIRST_SKY + SKY - 1);
    let sea = HEIGHT - horizon;
    while y < HEIGHT {
        let (depth, fade) = (y - horizon, HEIGHT - y);
        // Waves at even distances: the nearer they are to the horizon, the closer together.
        let phase = 9000 / (depth + 8) % 64;
        let crest = if phase < 32 { phase } else { 63 - phase };
        let glitter = (SEA - 1) * fade * fade * (20 + crest) / (sea * sea * 51);
        lines[y] = (FIRST_SEA + glitter) as u8;
        y += 1;
    }
    lines
}

/// Towards the lamp, which is at the upper left in front of the screen; a unit vector, 14 fraction bits.
const LAMP: [i64; 3] = [-7000, -6200, -13_400];
/// Halfway between the lamp and the viewer: the normal at which a mirror would show the lamp.
const HALFWAY: [i64; 3] = [-3674, -3254, -15_632];
/// Towards the dusk behind the ball, opposite the lamp: lights the rim of the dark side.
const DUSK: [i64; 3] = [9800, 9800, 8700];

/// Returns the light level of a face whose outward normal in view space is `normal`, 14 fraction bits.
pub fn lit_level(normal: Vec3) -> usize {
    let normal = normal.map(i64::from);
    // The cosine of the angle between two unit vectors: at most 2^14, except for rounding.
    let cosine = |v: [i64; 3]| (0..3).map(|k| normal[k] * v[k]).sum::<i64>() >> 14;
    // The lamp is large: its light reaches a quarter of the radius beyond the terminator.
    let lamp = (cosine(LAMP) + 4096).max(0) * 4 / 5;
    // Squared, the light stays at the rim and leaves a shadow inside it.
    let dusk = cosine(DUSK).max(0).pow(2) >> 14;
    // The 32nd power: a highlight three facets wide.
    let highlight = (0..5).fold(cosine(HALFWAY).max(0), |power, _| (power * power) >> 14);
    let level = (lamp * 16 + dusk * 24 + highlight * 8 + (1 << 13)) >> 14;
    level.clamp(0, LIGHT_LEVELS as i64 - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns ten times the brightness of a colour, by the usual weights of red, green and blue.
    fn brightness(colour: usize) -> u32 {
        let [r, g, b] = PALETTE[colour].map(u32::from);
        3 * r + 6 * g + b
    }

    fn ramp_of(colour: usize) -> Option<usize> {
        (FIRST_SHADE..FIRST_SKY)
            .contains(&colour)
            .then(|| (colour - FIRST_SHADE) / SHADES)
    }

    #[test]
    fn the_palette_is_of_6_bits_and_begins_with_black() {
        assert!(PALETTE.iter().flatten().all(|&channel| channel < 64));
        assert_eq!(PALETTE[usize::from(BLACK)], [0; 3]);
        assert_eq!(Ramp::Pearl.shade(SHADES), FIRST_SKY as u8);
    }

    #[test]
    fn ramps_brighten_from_shade_to_shade() {
        for colour in FIRST_SHADE + 1..FIRST_SKY {
            if ramp_of(colour) == ramp_of(colour - 1) {
                assert!(brightness(colour) > brightness(colour - 1), "{colour}");
            }
        }
    }

    #[test]
    fn light_moves_a_colour_along_its_ramp() {
        for colour in 0..=255u8 {
            let colour = usize::from(colour);
            let lit = |level: usize| usize::from(LIGHT_TABLE[level][colour]);
            assert_eq!(lit(FULL_LIGHT), colour);
            for level in 1..LIGHT_LEVELS {
                assert_eq!(ramp_of(lit(level)), ramp_of(colour), "{colour} at {level}");
                assert!(lit(level) >= lit(level - 1), "{colour} at {level}");
            }
        }
    }

    #[test]
    fn the_ball_has_a_highlight_a_dark_side_and_a_rim() {
        let level = |normal: [i64; 3]| lit_level(normal.map(|c| c as i32));
        assert_eq!(level(HALFWAY), LIGHT_LEVELS - 1);
        // From the ball's centre down to the right: 0, 45 and 70 degrees.
        let middle = level([0, 0, -16_384]);
        let shadow = level([8192, 8192, -11_585]);
        let rim = level([10_886, 10_886, -5604]);
        assert!(shadow < rim && rim < middle, "{middle}, {shadow}, {rim}");
    }

    #[test]
    fn the_sky_has_no_edge_and_the_sea_is_the_seas() {
        for y in 0..HEIGHT {
            let colour = usize::from(BACKGROUND[y]);
            let own = if y < HORIZON {
                FIRST_SKY..FIRST_SEA
            } else {
                FIRST_SEA..256
            };
            assert!(own.contains(&colour), "line {y}");
            if y > 0 && y < HORIZON {
                let before = PALETTE[usize::from(BACKGROUND[y - 1])];
                for (a, b) in PALETTE[colour].into_iter().zip(before) {
                    // 4 of 63, where the glow is steepest.
                    assert!(a.abs_diff(b) <= 4, "line {y}");
                }
            }
        }
    }
}
