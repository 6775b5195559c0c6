//! Statistics of errors and of times.

/// Returns the median; for an even count, the mean of the two middle values.
///
/// # Panics
/// If `values` is empty.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    match sorted.len() % 2 {
        1 => sorted[half],
        _ => (sorted[half - 1] + sorted[half]) / 2.0,
    }
}

/// A median, with the smallest and largest of its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The smallest value.
    pub least: f64,
    /// The largest value.
    pub most: f64,
}

impl Spread {
    /// Returns the spread of some values.
    ///
    /// # Panics
    /// If `values` is empty.
    pub fn of(values: &[f64]) -> Self {
        Self {
            median: median(values),
            least: values.iter().copied().fold(f64::INFINITY, f64::min),
            most: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// Returns half the distance from the smallest to the largest value.
    pub fn half(&self) -> f64 {
        (self.most - self.least) / 2.0
    }

    /// Returns the geometric mean of some spreads, field by field.
    ///
    /// # Panics
    /// If `all` is empty.
    pub fn mean(all: &[Self]) -> Self {
        assert!(!all.is_empty(), "a mean of nothing");
        let mean = |part: fn(&Self) -> f64| {
            let logs: f64 = all.iter().map(|spread| part(spread).ln()).sum();
            (logs / all.len() as f64).exp()
        };
        Self {
            median: mean(|spread| spread.median),
            least: mean(|spread| spread.least),
            most: mean(|spread| spread.most),
        }
    }

    /// Returns the distance from the smallest to the largest value, in per cent of the median.
    pub fn percent(&self) -> f64 {
        100.0 * (self.most - self.least) / self.median
    }
}

/// Classes of errors in an octave: a percentile is accurate to 1.1 %.
const CLASSES: i32 = 64;
/// The range of errors that the classes distinguish: from 2^-20 texel to 2^9.
const OCTAVES: std::ops::Range<i32> = -20..9;

/// A histogram of errors, so that the errors of many frames fit into memory.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorHistogram {
    /// The number of errors in each class, the smallest errors first. Errors below all classes count in the
    /// first class.
    classes: Vec<u32>,
    count: u64,
    sum: f64,
    largest: f64,
}

impl Default for ErrorHistogram {
    fn default() -> Self {
        Self {
            classes: vec![0; (OCTAVES.len() as i32 * CLASSES) as usize],
            count: 0,
            sum: 0.0,
            largest: 0.0,
        }
    }
}

impl ErrorHistogram {
    /// Adds an error.
    pub fn add(&mut self, error: f64) {
        let above = (error.log2() - f64::from(OCTAVES.start)) * f64::from(CLASSES);
        // The logarithm of zero is minus infinity, which goes into the first class.
        let class = (above.max(0.0) as usize).min(self.classes.len() - 1);
        self.classes[class] += 1;
        self.count += 1;
        self.sum += error;
        self.largest = self.largest.max(error);
    }

    /// Adds the errors of `other`.
    pub fn extend(&mut self, other: &Self) {
        for (class, more) in self.classes.iter_mut().zip(&other.classes) {
            *class += more;
        }
        self.count += other.count;
        self.sum += other.sum;
        self.largest = self.largest.max(other.largest);
    }

    /// Returns the number of errors.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the largest error, exactly.
    pub fn largest(&self) -> f64 {
        self.largest
    }

    /// Returns the mean error, or 0 without errors.
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    /// Returns the error that a `share` (0 to 1) of the errors does not exceed, rounded up to the end of its
    /// class.
    pub fn percentile(&self, share: f64) -> f64 {
        let enough = (share * self.count as f64).ceil() as u64;
        let mut below = 0;
        for (class, &count) in (1..).zip(&self.classes) {
            below += u64::from(count);
            if below >= enough {
                if class as usize == self.classes.len() {
                    // The last class also holds all errors above it.
                    break;
                }
                let octave = f64::from(class) / f64::from(CLASSES) + f64::from(OCTAVES.start);
                return octave.exp2().min(self.largest);
            }
        }
        self.largest
    }
}

/// Returns the peak signal-to-noise ratio of two frames with 8 bits a component, in decibels. It is infinite
/// for equal frames.
///
/// # Panics
/// If the frames have different numbers of pixels.
pub fn psnr(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    assert_eq!(
        a.len(),
        b.len(),
        "the frames have different numbers of pixels"
    );
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let squares: f64 = pairs.map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2)).sum();
    let parts = 3.0 * a.len() as f64;
    10.0 * (255.0f64.powi(2) * parts / squares).log10()
}

/// Returns the indices of the points that no other point beats, by rising cost. Each point is a cost and an
/// error. A point beats another if it is at most as large in both, and smaller in one.
pub fn pareto(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        let ((a, a_error), (b, b_error)) = (points[a], points[b]);
        a.total_cmp(&b).then(a_error.total_cmp(&b_error))
    });
    let mut front: Vec<usize> = Vec::new();
    for i in order {
        // Equal points are both on the front: neither beats the other.
        match front.last().map(|&last| points[last]) {
            Some(last) if points[i].1 >= last.1 && points[i] != last => {}
            _ => front.push(i),
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_the_median_the_least_and_the_most() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        let spread = Spread::of(&[10.0, 9.0, 12.0, 10.0, 11.0]);
        assert_eq!(
            (spread.median, spread.least, spread.most),
            (10.0, 9.0, 12.0)
        );
        assert_eq!((spread.percent(), spread.half()), (30.0, 1.5));
        let double = Spread::of(&[20.0, 40.0, 24.0]);
        let mean = Spread::mean(&[double, Spread::of(&[6.0])]);
        for (got, square) in [
            (mean.median, 144.0),
            (mean.least, 120.0),
            (mean.most, 240.0f64),
        ] {
            assert!((got - square.sqrt()).abs() < 1e-9);
        }
    }

    #[test]
    fn percentiles_equal_those_of_the_sorted_list_within_a_class() {
        let mut random = seeded::generator();
        for _ in 0..50 {
            let mut errors = ErrorHistogram::default();
            let count = random.usize(1..2000);
            let mut list: Vec<f64> = (0..count)
                .map(|_| (random.f64() * 26.0 - 18.0).exp2())
                .collect();
            // Two histograms, joined.
            let mut second = ErrorHistogram::default();
            let half = random.usize(..=count);
            list[..half].iter().for_each(|&error| errors.add(error));
            list[half..].iter().for_each(|&error| second.add(error));
            errors.extend(&second);
            list.sort_by(f64::total_cmp);
            assert_eq!(errors.count(), count as u64);
            assert_eq!(errors.largest(), list[count - 1]);
            let mean = list.iter().sum::<f64>() / count as f64;
            assert!((errors.mean() / mean - 1.0).abs() < 1e-9);
            for share in [0.01, 0.5, 0.99, 1.0] {
                let exact = list[((share * count as f64).ceil() as usize).max(1) - 1];
                let found = errors.percentile(share);
                // Never too small, and at most one class too large.
                assert!(
                    found >= exact && found <= exact * 1.011,
                    "{found} for {exact}"
                );
            }
        }
    }

    #[test]
    fn errors_outside_all_classes_are_counted() {
        let mut errors = ErrorHistogram::default();
        assert_eq!((errors.mean(), errors.percentile(0.99)), (0.0, 0.0));
        errors.add(0.0);
        assert_eq!((errors.largest(), errors.percentile(1.0)), (0.0, 0.0));
        errors.add(4000.0);
        assert_eq!(errors.percentile(1.0), 4000.0);
        assert_eq!(errors.mean(), 2000.0);
    }

    #[test]
    fn psnr_is_in_decibels() {
        let black = [[0; 3]; 4];
        assert_eq!(psnr(&black, &black), f64::INFINITY);
        assert_eq!(psnr(&black, &[[255; 3]; 4]), 0.0);
        // One component of twelve differs by one: 12 x 255^2.
        let mut near = black;
        near[2][1] = 1;
        assert!((psnr(&black, &near) - 10.0 * (12.0 * 65025.0f64).log10()).abs() < 1e-9);
    }

    #[test]
    fn the_pareto_front_has_the_points_that_no_point_beats() {
        let mut random = seeded::generator();
        for _ in 0..200 {
            // Only eight values, so that many points are equal in cost, in error or in both.
            let mut point = || (f64::from(random.u8(..8)), f64::from(random.u8(..8)));
            let points: Vec<_> = (0..12).map(|_| point()).collect();
            let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
            let mut front = pareto(&points);
            assert!(front.is_sorted_by_key(|&i| points[i].0));
            front.sort_unstable();
            let unbeaten: Vec<usize> = (0..points.len())
                .filter(|&i| !points.iter().any(|&other| beats(other, points[i])))
                .collect();
            assert_eq!(front, unbeaten, "{points:?}");
        }
    }
}
