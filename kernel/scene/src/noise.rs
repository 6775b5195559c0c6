//! Smooth noise in integers, for textures drawn by code.

/// Value noise at a point with 16 fraction bits a cell: 0 to 65 535, smooth over the cells.
pub fn noise(point: [i64; 3], seed: u32) -> i64 {
    let cell = point.map(|c| c >> 16);
    // 3t^2 - 2t^3, so that slopes meet at the cells' corners.
    let smooth = point.map(|c| {
        let t = c & 0xFFFF;
        (((t * t) >> 16) * (3 * 65_536 - 2 * t)) >> 16
    });
    let mut sum = 0;
    for corner in 0..8i64 {
        let offset = [corner & 1, (corner >> 1) & 1, (corner >> 2) & 1];
        let mut weight = 65_536;
        for k in 0..3 {
            weight = weight
                * if offset[k] == 1 {
                    smooth[k]
                } else {
                    65_536 - smooth[k]
                }
                >> 16;
        }
        sum += weight * hash([0, 1, 2].map(|k| cell[k] + offset[k]), seed) >> 16;
    }
    sum.min(65_535)
}

/// Four octaves of [`noise`], each half as strong and twice as fine: 0 to 65 535.
pub fn fractal(point: [i64; 3], seed: u32) -> i64 {
    (0..4)
        .map(|octave| noise(point.map(|c| c << octave), seed + octave) >> (octave + 1))
        .sum::<i64>()
        * 16
        / 15
}

fn hash(cell: [i64; 3], seed: u32) -> i64 {
    let mut h = seed.wrapping_mul(0x9E37_79B9);
    for c in cell {
        h = (h ^ c as u32).wrapping_mul(0x85EB_CA6B);
        h ^= h >> 15;
    }
    i64::from(h.wrapping_mul(0xC2B2_AE35) >> 16)
}
