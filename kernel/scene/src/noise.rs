//! Smooth noise in integers, for textures drawn by code.

/// One, with the 16 fraction bits of every number here.
pub const ONE: i64 = 1 << 16;

/// Returns value noise at a point whose cells have 16 fraction bits: 0 to 65 535, smooth across cells.
pub fn noise(point: [i64; 3], seed: u32) -> i64 {
    let [x, y, z] = point.map(|c| c >> 16);
    // 3t^2 - 2t^3, so that slopes meet at the cells' corners; 0 to 65 535.
    let [sx, sy, sz] = point.map(|c| {
        let t = c & (ONE - 1);
        (((t * t) >> 16) * (3 * ONE - 2 * t)) >> 16
    });
    let along_x = |y, z| mix(hash([x, y, z], seed), hash([x + 1, y, z], seed), sx);
    let along_y = |z| mix(along_x(y, z), along_x(y + 1, z), sy);
    mix(along_y(z), along_y(z + 1), sz)
}

/// Returns the sum of `octaves` octaves of [`noise`], each half as strong and twice as fine. Sums crowd
/// around the middle, so the result is stretched: 0 to 65 535.
pub fn fractal(point: [i64; 3], octaves: u32, seed: u32) -> i64 {
    let sum: i64 = (0..octaves)
        .map(|octave| noise(point.map(|c| c << octave), seed + octave) >> (octave + 1))
        .sum();
    ((sum - ONE / 2) * 2 + ONE / 2).clamp(0, ONE - 1)
}

/// Interpolates from `a` (at `t` = 0) towards `b` (at 65 536).
const fn mix(a: i64, b: i64, t: i64) -> i64 {
    a + (((b - a) * t) >> 16)
}

/// Returns a hash of a cell: 0 to 65 535.
pub fn hash(cell: [i64; 3], seed: u32) -> i64 {
    let mut h = seed.wrapping_mul(0x9E37_79B9);
    for c in cell {
        h = (h ^ c as u32).wrapping_mul(0x85EB_CA6B);
        h ^= h >> 15;
    }
    i64::from(h.wrapping_mul(0xC2B2_AE35) >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_and_keeps_its_range() {
        let mut before = noise([-3 * ONE, 700, 41_000], 5);
        for x in -3 * ONE..3 * ONE {
            let now = noise([x, 700, 41_000], 5);
            assert!((0..ONE).contains(&now) && now.abs_diff(before) < 8, "{x}");
            before = now;
        }
        let corner = [7, -2, 1];
        assert_eq!(noise(corner.map(|c| c * ONE), 9), hash(corner, 9));
    }

    #[test]
    fn fractal_reaches_both_ends_and_no_farther() {
        let all = (0..4000).map(|i| fractal([i * 9001, i * 77, i * 5], 4, 1));
        let (least, most) = all.fold((ONE, 0), |(a, b), n| (a.min(n), b.max(n)));
        assert!((0..ONE / 16).contains(&least) && (ONE * 15 / 16..ONE).contains(&most));
    }
}
