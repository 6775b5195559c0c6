//! The ball's texture, drawn by code: a celestial globe in enamel, gold and silver.
//!
//! The layers are, from front to back: the belt of the zodiac, the compass roses on the poles, the wires, the
//! stars, the nebula. Each layer either has a colour for a texel or leaves it to the next layer.
//!
//! The nebula is a function of the point on the sphere, not of longitude and polar angle: it has no seam
//! where the texture closes and no pinch at the poles. Metal is drawn on a grid of degrees, and every wire
//! has a dark edge, as in cloisonne: it keeps gold readable on any enamel, and hides the steps of the
//! outline.

use crate::colour::Ramp;
use crate::noise::{ONE, fractal, hash};
use crate::trig::sin;

/// A degree as a fraction of a turn.
const DEGREE: i64 = (1 << 32) / 360;
/// Columns of the drawing grid, one texel each: once around.
pub const COLUMNS: u64 = 240;
/// Rows of the drawing grid, one texel and one degree each: from pole to pole.
pub const ROWS: u64 = 180;
/// Columns from one sign of the zodiac to the next.
const SIGN: i64 = 20;

/// The twelve signs, Aries first, each 11 columns wide, with one column between them.
const SIGNS: [[&[u8; 71]; 12]; 2] = [
    [
        b".##.....##. #.........# #.........# ...#######. ...####.... #..#..#....",
        b"#..#...#..# .#.......#. .#########. ..#.......# ..#....#... .##.##.#...",
        b"#..#...#..# ..#.....#.. ...#...#... .##........ ..#....#... .#..#..#.#.",
        b"....#.#.... ...#####... ...#...#... #..#....... ..#....#... .#..#..##.#",
        b"....#.#.... ..#.....#.. ...#...#... #..#....... ...#...#... .#..#..#..#",
        b"....#.#.... .#.......#. ...#...#... .##.....##. .##....#... .#..#..#..#",
        b".....#..... #.........# ...#...#... .......#..# #..#..#.... .#..#..#.#.",
        b".....#..... #.........# ...#...#... .......#..# #..#..#.... .#..#..##..",
        b".....#..... #.........# ...#...#... ........##. .##..#..... .#..#..#...",
        b".....#..... .#.......#. ...#...#... #.......#.. .....#....# .......##..",
        b".....#..... ..#.....#.. .#########. .#######... .....#...#. ......#..#.",
        b".....#..... ...#####... #.........# ........... ......###.. .....#....#",
    ],
    [
        b"........... #..#..#.... .....###### #...##..... ........... #.........#",
        b"....###.... .##.##.#... .........## .#.#..#.... ..#...#...# .#.......#.",
        b"..##...##.. .#..#..#... ........#.# ..##..#.... .#.#.#.#.#. ..#.....#..",
        b".#.......#. .#..#..#... .......#..# ..#...#.... #...#...#.. ..#.....#..",
        b".#.......#. .#..#..#... ..#...#...# ..#...#.... ........... ..#.....#..",
        b".#.......#. .#..#..#... ...#.#....# ..#...#.... ........... ###########",
        b"..#.....#.. .#..#..#... ....#...... ..#...#.##. ........... ..#.....#..",
        b"####...#### .#..#..#... ...#.#..... ..#...##..# ..#...#...# ..#.....#..",
        b"........... .#..#..#..# ..#...#.... ......#...# .#.#.#.#.#. ..#.....#..",
        b"........... .......#.## .#......... ......##..# #...#...#.. .#.......#.",
        b"########### .......#..# #.......... .....#..##. ........... #.........#",
        b"........... ........##. #.......... ...##...... ........... ...........",
    ],
];

/// The shade of the dark edge beside metal.
const EDGE: u8 = Ramp::Indigo.shade(2);

/// Returns the colour of the texel at a longitude, a polar angle up to half a turn, and the corresponding
/// point on the unit sphere (30 fraction bits).
pub fn texel(longitude: u32, polar: u32, point: [i64; 3]) -> u8 {
    let column = ((u64::from(longitude) * COLUMNS) >> 32) as i64;
    let row = ((u64::from(polar) * 2 * ROWS) >> 32) as i64;
    belt(column, row)
        .or_else(|| rose(longitude, polar))
        .or_else(|| wire(longitude, polar, point))
        .or_else(|| star(column, row))
        .unwrap_or_else(|| nebula(point))
}

/// Returns the colour of the belt of the zodiac around the equator, or `None` beside it.
fn belt(column: i64, row: i64) -> Option<u8> {
    let (sign, x) = (column / SIGN, column % SIGN);
    // Half degrees from the equator, downwards: an odd number, since the equator separates two rows.
    let down = 2 * row + 1 - ROWS as i64;
    let from_equator = down.abs();
    let from_meridian = x.min(SIGN - x);
    Some(match from_equator {
        23.. => return None,
        17 | 21 => EDGE,
        // The upper rim catches the light; the lower rim is in its own shadow.
        19 => Ramp::Gold.shade(if down < 0 { 18 } else { 14 }),
        _ if in_sign(sign, x, row) => Ramp::Gold.shade(20),
        // The sign's shadow on the enamel makes it look raised.
        _ if in_sign(sign, x - 1, row) || in_sign(sign, x, row - 1) => Ramp::Rose.shade(2),
        // A lozenge between two signs.
        _ if 4 * from_meridian + from_equator < 9 => {
            Ramp::Gold.shade(18 - 2 * from_meridian as usize)
        }
        // Enamel, brightest in the middle: the belt looks rounded.
        _ => Ramp::Rose.shade((9 - from_equator / 4) as usize),
    })
}

/// Returns whether a sign's drawing covers column `x` of the sign's field and row `row` of the globe.
fn in_sign(sign: i64, x: i64, row: i64) -> bool {
    let (x, y) = (x - 5, row - (ROWS as i64 / 2 - 6));
    (0..11).contains(&x)
        && (0..12).contains(&y)
        && SIGNS[sign as usize / 6][y as usize][(sign % 6 * 12 + x) as usize] == b'#'
}

/// Returns the colour of the compass roses on the poles, or `None` beside them.
fn rose(longitude: u32, polar: u32) -> Option<u8> {
    let polar = i64::from(polar);
    // Quarter degrees from the nearer pole.
    let radius = polar.min((1 << 31) - polar) * 4 / DEGREE;
    // Six long points, and six short points between them. Each value is the angle from the point's axis,
    // scaled so that a whole turn leads from one axis to the next.
    let long = longitude.wrapping_mul(6);
    let short = long.wrapping_add(1 << 31);
    let in_point = |angle: u32, tip: i64, valley: i64| {
        // A straight side from the tip to the valley: 1 / radius is nearly linear in the angle.
        let from_axis = i64::from(angle.min(angle.wrapping_neg()) >> 15);
        radius * (valley + (((tip - valley) * from_axis) >> 16)) < tip * valley
    };
    // Each point has a ridge: one half is lit, the other is in shade.
    let half = |angle: u32, lit, shaded| if angle >> 31 == 1 { lit } else { shaded };
    Some(match radius {
        112.. => return None,
        96..100 | 108.. => EDGE,
        100.. => Ramp::Gold.shade(18),
        ..10 => Ramp::Pearl.shade(21),
        _ if in_point(long, 94, 30) => Ramp::Gold.shade(half(long, 20, 11)),
        _ if in_point(short, 78, 26) => Ramp::Pearl.shade(half(short, 18, 9)),
        // Enamel, darker outwards: the cap looks domed.
        _ => Ramp::Teal.shade((15 - radius / 12) as usize),
    })
}

/// Returns the colour of the six gold meridians and of the path of the moon in silver, or `None` beside them.
fn wire(longitude: u32, polar: u32, point: [i64; 3]) -> Option<u8> {
    // Through the centre of the lozenges, which is the middle of a column.
    let from_first = i64::from(longitude) - 3 * DEGREE / 4;
    let from_nearest = (from_first + 30 * DEGREE).rem_euclid(60 * DEGREE) - 30 * DEGREE;
    // Away from the equator the same angle spans a shorter distance: this keeps the wires' width. The product
    // is at most 2^29 (30 degrees and less) x 2^30.
    let meridian = (from_nearest.abs() * sin(polar)) >> 30;
    // The plane through the centre with the normal (0, 4, 3) / 5, tipped by 37 degrees. 7 / 11 is about 2 /
    // pi, which converts a sine with 30 fraction bits to a fraction of a turn in 32 bits.
    let moon = (point[1] * 4 + point[2] * 3).abs() * 7 / (5 * 11);
    let half_width = 3 * DEGREE / 4;
    if meridian < half_width {
        Some(Ramp::Gold.shade(17))
    } else if moon < half_width {
        Some(Ramp::Pearl.shade(16))
    } else if meridian.min(moon) < half_width + DEGREE {
        Some(EDGE)
    } else {
        None
    }
}

/// Returns the colour of a star, or `None` beside the stars. One star lies at a random place in each cell of
/// 10 columns and 12 rows, so that they neither cluster nor line up. A quarter of them are large.
fn star(column: i64, row: i64) -> Option<u8> {
    let random = hash([column / 10, row / 12, 0], 77);
    // At least one column and row from the cell's border: a large star does not cross it.
    let (x, y) = (1 + random % 8, 1 + random / 8 % 10);
    let size = (random >> 8) % 4;
    match (column % 10 - x).abs() + (row % 12 - y).abs() {
        0 => Some(Ramp::Pearl.shade(17 + 2 * size as usize)),
        1 if size == 3 => Some(Ramp::Pearl.shade(14)),
        _ => None,
    }
}

/// Returns the colour of clouds of light: noise, looked up at a point that other noise has displaced. The
/// displacement turns blots into swirls.
fn nebula(point: [i64; 3]) -> u8 {
    // A cell of the coarsest noise is a third of the ball's width.
    let place = point.map(|c| (c * 3) >> 15);
    let push = [10, 20, 30].map(|seed| fractal(place, 2, seed) - ONE / 2);
    let pushed = [0, 1, 2].map(|k| place[k] + 2 * push[k]);
    let cloud = fractal(pushed, 5, 40);
    // A line where noise crosses its middle; the third power makes the line thin.
    let ridge = ONE - (2 * fractal(pushed.map(|c| c / 2), 4, 50) - ONE).abs();
    let filament = (((ridge * ridge) >> 16) * ridge) >> 16;
    // 3 to 20: never black, and room for the highlight.
    let shade = (3 * ONE + 9 * cloud + 9 * filament) >> 16;
    // The displacement changes slowly, so the hue does; a little of the cloud frays the borders.
    let ramp = match ((push[0] + ONE / 2 + cloud / 4) * 5) >> 16 {
        ..1 => Ramp::Rose,
        1 => Ramp::Violet,
        2 => Ramp::Indigo,
        3 => Ramp::Azure,
        _ => Ramp::Teal,
    };
    ramp.shade(shade as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::{RAMPS, SHADES};
    use crate::trig::{cos, mul};
    use crate::{TEXELS, paint_ball};

    #[test]
    fn every_texel_is_a_shade_of_a_ramp() {
        let mut texels = [0; TEXELS];
        paint_ball(&mut texels);
        let first = Ramp::Violet.shade(0);
        let mut used = [false; RAMPS];
        for texel in texels {
            let ramp = usize::from(texel.checked_sub(first).unwrap()) / SHADES;
            used[ramp] = true;
        }
        assert_eq!(used, [true; RAMPS]);
    }

    fn nebula_at(longitude: u32, polar: u32) -> u8 {
        let ring = sin(polar);
        nebula([
            mul(ring, sin(longitude)),
            -cos(polar),
            -mul(ring, cos(longitude)),
        ])
    }

    /// Returns whether two colours are at most one shade apart. The hue may differ.
    fn near(a: u8, b: u8) -> bool {
        let shade = |colour| usize::from(colour - Ramp::Violet.shade(0)) % SHADES;
        shade(a).abs_diff(shade(b)) <= 1
    }

    #[test]
    fn the_nebula_has_no_seam_and_no_pinch() {
        for i in 0..200 {
            let polar = i * ((1 << 31) / 200);
            assert!(
                near(nebula_at(0, polar), nebula_at(u32::MAX, polar)),
                "{polar}"
            );
            let longitude = i * (u32::MAX / 200);
            for pole in [0, 1 << 31] {
                assert_eq!(nebula_at(longitude, pole), nebula_at(0, pole));
            }
        }
    }

    #[test]
    fn metal_repeats_around_the_globe() {
        for row in 0..ROWS as i64 {
            for column in 0..SIGN / 2 - 5 {
                let at = |sign: i64| belt(sign * SIGN + column, row);
                assert!((1..12).all(|sign| at(sign) == at(0)), "{column}, {row}");
            }
        }
        for sign in 0..12 {
            let drawn = (0..SIGN * ROWS as i64)
                .filter(|i| in_sign(sign, i % SIGN, i / SIGN))
                .count();
            assert!((18..50).contains(&drawn), "sign {sign} has {drawn} texels");
        }
    }
}
