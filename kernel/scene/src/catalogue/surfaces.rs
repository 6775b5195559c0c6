//! The textures of the measuring scenes, drawn by code: a dial, a board, a plain, a wall of bricks and the
//! side of a crate. Each has lines, which show every bend. The dial and the board also have text, which shows
//! a texture that is mirrored or turned.

use texmap::Texture;

use crate::colour::Ramp::{self, Azure, Gold, Indigo, Pearl, Rose, Teal, Violet};
use crate::entry::MAX_TEXELS;
use crate::font::covers;
use crate::noise::{ONE, fractal, hash};
use crate::trig::{cos, sin};

/// Texels across the texture, and down.
pub const SIDE: usize = 256;

/// Paints a texture texel by texel: `texel` returns the colour of column i and row j.
pub fn paint(texels: &mut [u8; MAX_TEXELS], texel: fn(i64, i64) -> u8) -> Texture<'_> {
    for (j, row) in texels.chunks_exact_mut(SIDE).enumerate() {
        for (i, colour) in row.iter_mut().enumerate() {
            *colour = texel(i as i64, j as i64);
        }
    }
    Texture::new(texels, SIDE as u16, SIDE as u16).expect("there are SIDE x SIDE texels")
}

/// Returns a shade of a ramp, limited so that the highlight has room.
pub fn shade(ramp: Ramp, shade: i64) -> u8 {
    ramp.shade(shade.clamp(1, 22) as usize)
}

/// Divides 0 to [`ONE`] into `steps` steps and returns the step of `value`: 0 to `steps` - 1.
pub fn part(value: i64, steps: i64) -> i64 {
    (value * steps) >> 16
}

/// Returns the direction of a point about the centre, as a fraction of a turn: 0 is up, clockwise.
fn direction(dx: i64, dy: i64) -> u32 {
    // Rotates the point into the quarter from up to right.
    let (quarter, x, y) = match (dx >= 0, dy < 0) {
        (true, true) => (0, dx, -dy),
        (true, false) => (1, dy, dx),
        (false, false) => (2, -dx, dy),
        (false, true) => (3, -dy, -dx),
    };
    let mut angle = 0u32;
    for bit in (14..30).rev() {
        let next = angle + (1 << bit);
        if sin(next) * y <= cos(next) * x {
            angle = next;
        }
    }
    (angle.min((1 << 30) - 1)) + quarter * (1 << 30)
}

/// Returns the distance of an angle from the nearest of `n` evenly spaced directions, and on which side it
/// lies: 0 to 2^31, which is half the way to the next direction.
fn from_ray(angle: u32, n: u32) -> (i64, bool) {
    let folded = angle.wrapping_mul(n);
    (
        i64::from(folded.min(folded.wrapping_neg())),
        folded >> 31 == 1,
    )
}

/// Returns the colour of a texel of a compass dial in gold, silver and enamel.
pub fn dial(i: i64, j: i64) -> u8 {
    // From the centre, in half texels: odd numbers.
    let (dx, dy) = (2 * i - 255, 2 * j - 255);
    let radius = (dx * dx + dy * dy).isqrt();
    let angle = direction(dx, dy);
    let edge = dx.abs().max(dy.abs());
    // Light from the upper left, as everywhere in this file.
    let lit = if dx + dy < 0 { 4 } else { 0 };
    if edge >= 240 {
        return match edge {
            240..244 | 254.. => Indigo.shade(2),
            _ => shade(Gold, 12 + lit - (edge - 249).abs() / 2),
        };
    }
    let cloud = |grain: i64| fractal([i * grain, j * grain, 0], 4, 7);
    match radius {
        ..26 => {
            // A crystal ball: a highlight, and light that has passed through it.
            let highlight = (dx + 9).pow(2) + (dy + 9).pow(2);
            let through = (dx - 10).pow(2) + (dy - 10).pow(2);
            shade(Azure, (22 - highlight / 14).max(16 - through / 16).max(6))
        }
        26..29 => Indigo.shade(2),
        29..34 => shade(Gold, 13 + lit),
        34..170 => {
            let in_point = |n, tip: i64, valley: i64| {
                let (from_axis, _) = from_ray(angle, n);
                radius * (valley + (((tip - valley) * from_axis) >> 31)) < tip * valley
            };
            let side = |n, dark: i64, light: i64| {
                let (_, before) = from_ray(angle, n);
                if before { light } else { dark }
            };
            let ring = |at: i64| (radius - at).abs() < 2;
            if in_point(4, 166, 40) {
                shade(Gold, side(4, 9, 19))
            } else if in_point_turned(angle, radius, 132, 40) {
                shade(Pearl, side_turned(angle, 9, 19))
            } else if in_point(16, 96, 50) {
                shade(Rose, side(16, 8, 15))
            } else if ring(104) || ring(142) {
                shade(Gold, 15)
            } else {
                let deep = if radius < 104 { Violet } else { Indigo };
                shade(deep, 4 + part(cloud(2200), 8) + radius / 40)
            }
        }
        170..174 | 182..185 | 226..229 | 235.. if radius < 238 => Indigo.shade(2),
        174..182 => shade(Gold, 14 + lit),
        185..226 => {
            let letter = ['N', 'E', 'S', 'W'];
            let nearest = angle.wrapping_add(1 << 29) >> 30;
            // Upright for a viewer who stands at the centre and looks outward.
            let (across, out) = match nearest {
                0 => (dx, -dy),
                1 => (dy, dx),
                2 => (-dx, dy),
                _ => (-dy, -dx),
            };
            let (x, y) = ((across + 10).div_euclid(4), (220 - out).div_euclid(4));
            if covers(letter[nearest as usize], x, y) {
                return shade(Gold, 20);
            }
            let near_letter = from_ray(angle, 4).0 < 1 << 29;
            let (tick, length) = match () {
                () if from_ray(angle, 8).0 < 8 * 9_000_000 => (true, 30),
                () if from_ray(angle, 24).0 < 24 * 7_000_000 => (true, 20),
                () => (from_ray(angle, 72).0 < 72 * 5_000_000, 10),
            };
            if tick && !near_letter && radius > 225 - length {
                shade(Pearl, 18)
            } else {
                shade(Teal, 4 + (226 - radius) / 8)
            }
        }
        229..235 => shade(Gold, 14 + lit),
        _ => {
            // The corners: enamel with a star in each.
            let (x, y) = (dx.abs() - 206, dy.abs() - 206);
            let star = (x * y).abs() + (x * x + y * y) / 10;
            match star {
                ..24 => shade(Gold, 20 - star / 5),
                24..44 => Indigo.shade(2),
                _ => shade(Rose, 4 + part(cloud(3000), 7)),
            }
        }
    }
}

/// Returns what `in_point` in [`dial`] does for a star of four points that is turned by an eighth of a turn.
fn in_point_turned(angle: u32, radius: i64, tip: i64, valley: i64) -> bool {
    let (from_axis, _) = from_ray(angle.wrapping_add(1 << 29), 4);
    radius * (valley + (((tip - valley) * from_axis) >> 31)) < tip * valley
}

fn side_turned(angle: u32, dark: i64, light: i64) -> i64 {
    let (_, before) = from_ray(angle.wrapping_add(1 << 29), 4);
    if before { light } else { dark }
}

/// Tiles of the board in a row.
const TILES: i64 = 8;

/// Returns the colour of a texel of a board of eight by eight marble tiles, each labelled with its place.
pub fn board(i: i64, j: i64) -> u8 {
    let side = SIDE as i64 / TILES;
    let (column, row) = (i / side, j / side);
    let (x, y) = (i % side, j % side);
    let dark = (column + row) % 2 == 0;
    let from_edge = x.min(y).min(side - 1 - x).min(side - 1 - y);
    if from_edge == 0 {
        // The joint: gold, as in an inlay; brighter at the outer border.
        let border = i == 0 || j == 0 || i == 255 || j == 255;
        return shade(Gold, if border { 18 } else { 13 });
    }
    if from_edge == 1 {
        return Indigo.shade(2);
    }
    let letter = char::from(b'A' + column as u8);
    let figure = char::from(b'8' - row as u8);
    let (glyph_x, glyph_y) = ((x - 5).div_euclid(2), (y - 9).div_euclid(2));
    let written = |x: i64, y: i64| covers(letter, x, y) || covers(figure, x - 6, y);
    if written(glyph_x, glyph_y) {
        return if dark {
            shade(Gold, 21)
        } else {
            Indigo.shade(4)
        };
    }
    // Each tile is cut from another place of the stone.
    let cut = hash([column, row, 3], 5) * 97;
    let place = [i * 5200 + cut, j * 5200, cut];
    let push = fractal(place.map(|c| c / 2), 3, 31) - ONE / 2;
    let ridge = ONE - (2 * fractal(place.map(|c| c + 2 * push), 4, 50) - ONE).abs();
    let vein = (((ridge * ridge) >> 16) * ridge) >> 16;
    if dark {
        let ramp = if (column + row) % 4 == 0 {
            Indigo
        } else {
            Violet
        };
        shade(ramp, 5 + part(vein, 8))
    } else {
        shade(Pearl, 19 - part(vein, 7))
    }
}

/// Returns the colour of a texel of a plain of small tiles with detail at every distance: near the eye a
/// texel shows a tile, far away a whole field.
pub fn plain(i: i64, j: i64) -> u8 {
    let (field_x, field_y) = (i / 16, j / 16);
    let (x, y) = (i % 16, j % 16);
    // Roads around each field, and a wide road through the centre.
    if i == 127 || i == 128 {
        return shade(Gold, if j % 2 == 0 { 21 } else { 15 });
    }
    if x == 0 || y == 0 {
        let crossing = x == y;
        return shade(Gold, if crossing { 22 } else { 13 + (i + j) % 2 * 3 });
    }
    let ramp = match hash([field_x, field_y, 1], 19) % 4 {
        0 => Teal,
        1 => Azure,
        2 => Violet,
        _ => Rose,
    };
    let checker = (i + j) % 2 * 6;
    let own = part(hash([i, j, 2], 23), 3);
    // A pond in some of the fields.
    let middle = (x - 8).pow(2) + (y - 8).pow(2);
    if middle < 12 && (field_x + field_y) % 2 == 0 {
        return shade(Pearl, 14 + own * 2);
    }
    shade(ramp, 8 + checker + own)
}

/// Returns the colour of a texel of a brick wall with a lit window in the middle.
pub fn bricks(i: i64, j: i64) -> u8 {
    // The window: a rectangle with a round top.
    let (dx, dy) = (2 * i - 255, 2 * j - 200);
    let outline = if dy < 0 {
        (dx * dx + dy * dy).isqrt()
    } else {
        dx.abs()
    };
    let sill = 130;
    if dy < sill && outline < 84 {
        let depth = (84 - outline).min(sill - dy);
        if depth < 22 {
            // Stones around it, with a joint between each two.
            let along = if dy < 0 {
                i64::from(direction(dx, dy) >> 20) / 170
            } else {
                dy / 33
            };
            let before = if dy < 0 {
                i64::from(direction(dx, dy) >> 20) % 170
            } else {
                dy % 33 * 5
            };
            if before < 10 || depth < 2 {
                return Indigo.shade(3);
            }
            let own = part(hash([along, i64::from(dx > 0), 9], 3), 4);
            return shade(Pearl, 12 + own + i64::from(dx + dy < 0) * 3 - depth / 9);
        }
        if depth < 25 {
            return Indigo.shade(2);
        }
        // A lattice of lead, and the glow behind the panes.
        let (a, b) = ((dx + dy).rem_euclid(28), (dx - dy).rem_euclid(28));
        if a.min(b) < 3 || dx.abs() < 3 {
            return Indigo.shade(3);
        }
        let pane = hash([(dx + dy).div_euclid(28), (dx - dy).div_euclid(28), 1], 41);
        let glow = 21 - ((dx * dx + (dy - 40).pow(2)).isqrt() / 14);
        return match pane % 7 {
            0 => shade(Rose, glow - 2),
            1 => shade(Azure, glow - 2),
            _ => shade(Gold, glow + part(pane, 2)),
        };
    }
    let course = j / 16;
    // The lowest three courses are of stone.
    let (ramp, width) = if course >= 13 {
        (Pearl, 64)
    } else {
        (Gold, 32)
    };
    let shifted = i + course % 2 * width / 2;
    let brick = shifted % SIDE as i64 / width;
    let (x, y) = (shifted % width, j % 16);
    let grain = fractal([i * 9000, j * 9000, 0], 3, 61);
    if x < 2 || y < 2 {
        return shade(Indigo, 4 + part(grain, 4));
    }
    let own = hash([course, brick, 0], 13);
    // Lit from the upper left: two bright sides and two dark sides.
    let bevel = i64::from(x == 2 || y == 2) * 2 - i64::from(x == width - 1 || y == 15) * 2;
    let body = part(own, 4) + part(grain, 5) + bevel;
    match (ramp, own % 5) {
        (Pearl, _) => shade(Pearl, 9 + body),
        (_, 0) => shade(Rose, 6 + body),
        _ => shade(Gold, 6 + body),
    }
}

/// Returns the colour of a texel of the side of a crate: boards, iron at the corners, and a crystal ball as
/// an emblem.
pub fn crate_side(i: i64, j: i64) -> u8 {
    let (dx, dy) = (2 * i - 255, 2 * j - 255);
    let edge = 255 - dx.abs().max(dy.abs());
    let radius = (dx * dx + dy * dy).isqrt();
    // Iron: a triangle in each corner, with a rivet.
    let corner = (255 - dx.abs()) + (255 - dy.abs());
    if corner < 96 {
        let rivet = (255 - dx.abs() - 30).pow(2) + (255 - dy.abs() - 30).pow(2);
        let shine = (dx.signum() * (255 - dx.abs() - 30) + dy.signum() * (255 - dy.abs() - 30)) / 3;
        return match (corner, rivet) {
            (88.., _) => Indigo.shade(2),
            (_, ..81) => shade(Pearl, 15 + shine),
            (_, ..140) => Pearl.shade(3),
            _ if edge < 5 => shade(Pearl, 12),
            _ => shade(
                Pearl,
                7 + part(fractal([i * 12_000, j * 12_000, 0], 3, 5), 3),
            ),
        };
    }
    if edge < 44 {
        // The frame: four boards that meet on the diagonals.
        let across = dx.abs() > dy.abs();
        return match edge {
            ..3 | 40.. => shade(Gold, 4),
            _ => wood(if across { j } else { i }, edge, i64::from(across), 11),
        };
    }
    if radius < 122 {
        return match radius {
            118.. => shade(Gold, 4),
            104.. => shade(Gold, 15 + i64::from(dx + dy < 0) * 4),
            100.. => Indigo.shade(2),
            _ => emblem(dx, dy, radius),
        };
    }
    // Slanted boards inside the frame.
    let slanted = i + j;
    match slanted % 32 {
        0 | 1 => shade(Gold, 3),
        _ => wood(i - j, slanted % 32 * 3, slanted / 32, 8),
    }
}

/// Returns the colour of a texel of wood with its grain along a board.
fn wood(along: i64, across: i64, board: i64, base: i64) -> u8 {
    let place = [along * 1500, across * 9000, board * 77_777];
    let rings = part(fractal(place, 3, 90), 6);
    let ring = (rings - 3).abs();
    shade(
        Gold,
        base - 2 + ring + part(hash([along / 3, across, board], 8), 2),
    )
}

/// Returns the colour of a texel of a crystal ball with a night sky in it.
fn emblem(dx: i64, dy: i64, radius: i64) -> u8 {
    let ball = (dx * dx + (dy + 10).pow(2)).isqrt();
    if ball < 68 {
        let highlight = ((dx + 26).pow(2) + (dy + 38).pow(2)).isqrt();
        if highlight < 13 {
            return shade(Pearl, 22 - highlight / 3);
        }
        let swirl = fractal([dx * 1400, dy * 1400 + dx * dx * 8, 9], 4, 77);
        let ramp = if swirl > ONE / 2 { Azure } else { Violet };
        return shade(ramp, 6 + part(swirl, 10) + (ball - 40).max(0) / 8);
    }
    if ball < 71 {
        return Indigo.shade(2);
    }
    // The ball's foot.
    if dy > 48 && dy < 80 && dx.abs() < 18 + (dy - 48) {
        return shade(Gold, 19 - (dx + 40) / 10);
    }
    shade(Teal, 9 - radius / 20)
}
