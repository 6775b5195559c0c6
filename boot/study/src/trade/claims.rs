//! The sources' claims, beside the measurements of this run.
//!
//! The texts are fixed; the figures come from the run.

use modex::HEIGHT;
use scene::Pose;
use scene::catalogue::Entry;
use texmap::{Mapper, Order};

use super::accuracy::{self, Accuracy, FrameJobs};
use super::clock;
use super::cost::{LENGTH, LongSpans, SweepPoint};
use super::stats::Spread;
use super::table::{Table, decibels, percent, texels};
use super::workload::with_poses;

/// A source's claim and its measurement.
#[derive(Clone, Debug)]
pub struct Claim {
    /// The source of the claim.
    pub source: &'static str,
    /// The claim.
    pub claimed: &'static str,
    /// The measured values.
    pub measured: String,
    /// The reason for the difference.
    pub why: &'static str,
}

const NOT_MEASURED: &str = "not measured, because this run left the mappers out";

/// Angles between the screen's axes and the line of constant depth, in tenths of a degree.
const TILTS: [u32; 7] = [0, 5, 10, 20, 50, 150, 450];

/// Returns the accuracy of the mapper `free-direction` at each of `TILTS`, if the mapper exists.
pub fn tilts() -> Option<Vec<(f64, Accuracy)>> {
    let mapper = Mapper::parse("free-direction")?;
    let entry = Entry::parse("grazing-16")?;
    let mut jobs = Box::new(FrameJobs::new());
    let tilts = TILTS.map(|tenths| {
        let pose = Pose {
            roll: ((u64::from(tenths) << 32) / 3600) as u32,
            ..entry.pose(0)
        };
        let accuracy = with_poses(entry, &[pose], |workload| {
            accuracy::measure(workload, mapper, &mut jobs)
        });
        (f64::from(tenths) / 10.0, accuracy)
    });
    Some(tilts.to_vec())
}

/// Returns every claim with its measurement.
pub fn all(
    tables: &[Table],
    sweep: &[SweepPoint],
    unrolling: Spread,
    tilts: Option<&[(f64, Accuracy)]>,
) -> Vec<Claim> {
    use Order::{Planes, Polygons};
    let spans = LongSpans(sweep);
    let unit = clock::UNIT;
    let time = |mapper, order| match spans.time(mapper, order) {
        Some(time) => format!("{time:.2}"),
        None => "?".into(),
    };
    let ratio = |slow: (&str, Order), fast: (&str, Order)| match (
        spans.time(slow.0, slow.1),
        spans.time(fast.0, fast.1),
    ) {
        (Some(slow), Some(fast)) => format!("{:.2} times", slow / fast),
        _ => NOT_MEASURED.into(),
    };
    let best = match (
        spans.time("row-steps", Polygons),
        spans.fastest_affine(Planes),
    ) {
        (Some(rows), Some(best)) => format!(
            "; to `{}`, plane by plane, {:.2} times",
            best.mapper,
            rows / best.cost.time.median
        ),
        _ => String::new(),
    };
    let step_table = match (
        spans.time("step-table", Polygons),
        spans.time("packed", Polygons),
        spans.time("step-table", Planes),
        spans.time("packed", Planes),
    ) {
        (Some(a), Some(b), Some(c), Some(d)) => {
            format!("{:+.2} {unit} by polygons, {:+.2} by planes", a - b, c - d)
        }
        _ => NOT_MEASURED.into(),
    };
    vec![
        Claim {
            source: "chapter 57, listing 57.2",
            claimed: "more than twice as fast as listing 57.1",
            measured: ratio(("row-multiply", Polygons), ("row-steps", Polygons)),
            why: "A multiplication cost 13 to 42 cycles; now it costs 3, and overlaps with other \
                  pixels. Steps form a chain in which each waits for the one before. On a VGA both \
                  listings select the plane for every pixel.",
        },
        Claim {
            source: "chapter 58, on listing 58.1",
            claimed: "nearly 10 % from unrolling",
            measured: format!(
                "{:.1} % from unrolling a loop of shifts and masks eight times",
                100.0 * (1.0 - 1.0 / unrolling.median)
            ),
            why: "A predicted branch costs almost nothing, so unrolling gains little, or loses to its \
                  own bookkeeping.",
        },
        Claim {
            source: "chapter 58, listing 58.2",
            claimed: "columns 2 to 4 times as fast as rows",
            measured: format!(
                "{} by polygons, {} with both by planes",
                ratio(("row-steps", Polygons), ("two-carries", Polygons)),
                ratio(("row-steps", Planes), ("two-carries", Planes)),
            ),
            why: "RAM needs no OUT, whose cost was most of the gain, and each store down a column \
                  is in another cache line. On a VGA the port writes count: a column needs one, a row \
                  one for each pixel.",
        },
        Claim {
            source: "chapter 58, at the end",
            claimed: "5 to 10 times as fast in all",
            measured: format!(
                "{} from `row-steps` to `packed`, by polygons{best}",
                ratio(("row-steps", Polygons), ("packed", Polygons)),
            ),
            why: "Drawing plane by plane now gains what the loop gained then.",
        },
        Claim {
            source: "chapter 58, on John Miles's loop",
            claimed: "a table of two steps costs half a cycle to one more than the branch",
            measured: step_table,
            why: "Carries follow a regular pattern, which today's branch predictors learn: then the \
                  branch is free. Where they do not learn the pattern, a misprediction costs about 15 \
                  cycles, and the table costs no more.",
        },
        Claim {
            source: "chapter 58, listing 58.3",
            claimed: "packed fractions: from 22 cycles to 10, and 9 without a segment prefix",
            measured: format!(
                "{} from `two-carries` to `packed` ({} {unit}) by polygons, {} ({}) by planes",
                ratio(("two-carries", Polygons), ("packed", Polygons)),
                time("packed", Polygons),
                ratio(("two-carries", Planes), ("packed", Planes)),
                time("packed", Planes),
            ),
            why: "64-bit code has no segments to swap. One unpredicted branch replaces two.",
        },
        Claim {
            source: "Free-direction mapping",
            claimed: "looks worst for very small rotations, Hc or Vc near 0",
            measured: match tilts {
                None => NOT_MEASURED.into(),
                Some(tilts) => {
                    let each = tilts.iter().map(|(degrees, accuracy)| {
                        format!("{degrees}°: {}", percent(accuracy.other_share()))
                    });
                    format!("other texels at {}", each.collect::<Vec<_>>().join(", "))
                }
            },
            why: "The share of wrong texels does not show it: it is about the same at every slope \
                  except 0 and 45 degrees, where the lines meet the pixels' centres. At a small slope \
                  a line stays in one row for long and then jumps, so the same error shows as long \
                  seams.",
        },
        Claim {
            source: "Subdivision",
            claimed: "the quadratic looks better than the linear with fewer pieces",
            measured: quadratic(tables),
            why: "Half as many pieces need as many quotients. The error falls with the cube of a \
                  piece's length instead of its square as long as the depth changes little in a piece, \
                  which is not so near a horizon.",
        },
    ]
}

/// Compares quadratic pieces of 32 pixels with linear pieces of 16, scene by scene.
fn quadratic(tables: &[Table]) -> String {
    let mut parts = Vec::new();
    for table in tables {
        let row = |name: &str| table.rows.iter().find(|row| row.name() == name);
        let (Some(quadratic), Some(linear)) = (row("quadratic-32"), row("linear-16")) else {
            return NOT_MEASURED.into();
        };
        if !["tilted", "grazing-16", "grazing-4096", "cube"].contains(&&table.scene[..]) {
            continue;
        }
        let figures = |accuracy: &Accuracy| {
            let mean = texels(accuracy.errors.mean());
            format!("{mean} ({})", decibels(accuracy.psnr))
        };
        parts.push(format!(
            "{}: {} to {}",
            table.scene,
            figures(&quadratic.accuracy),
            figures(&linear.accuracy)
        ));
    }
    match parts.is_empty() {
        true => NOT_MEASURED.into(),
        false => format!(
            "mean error in texels (and PSNR), `quadratic-32` to `linear-16`: {}",
            parts.join("; ")
        ),
    }
}

/// Returns the cells of the table, the header first.
pub fn cells(claims: &[Claim]) -> Vec<Vec<String>> {
    let head = ["source", "claim", "measured here", "reason"].map(String::from);
    let mut cells = vec![head.to_vec()];
    cells.extend(claims.iter().map(|claim| {
        let Claim {
            source,
            claimed,
            measured,
            why,
        } = claim;
        vec![
            (*source).into(),
            (*claimed).into(),
            measured.clone(),
            why.split_whitespace().collect::<Vec<_>>().join(" "),
        ]
    }));
    cells
}

/// The span length of the measurements is the height of the screen: no span of a column is longer.
const _: () = assert!(LENGTH as usize == HEIGHT);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::cost::{ANGLE, PixelCost};
    use crate::trade::table::tests::made_up;

    fn sweep(mapper: &str, order: Order, time: f64) -> SweepPoint {
        let one = Spread::of(&[1.0]);
        SweepPoint {
            length: LENGTH,
            angle: ANGLE,
            mapper: Mapper::parse(mapper).unwrap(),
            order,
            cost: PixelCost {
                time: Spread::of(&[time]),
                to_bare: one,
                to_packed: one,
            },
        }
    }

    #[test]
    fn claims_show_the_figures_of_the_run() {
        let mut points = Vec::new();
        for (order, scale) in [(Order::Polygons, 1.0), (Order::Planes, 0.5)] {
            for (mapper, time) in [
                ("row-multiply", 9.0),
                ("row-steps", 6.0),
                ("two-carries", 4.0),
                ("packed", 3.0),
                ("step-table", 2.0),
                ("extract", 1.0),
            ] {
                points.push(sweep(mapper, order, time * scale));
            }
        }
        let tables = [made_up("tilted", 1.0)];
        let claims = all(&tables, &points, Spread::of(&[1.25]), None);
        let measured: Vec<_> = claims.iter().map(|claim| &claim.measured[..]).collect();
        assert_eq!(measured[0], "1.50 times");
        assert!(measured[1].starts_with("20.0 %"));
        assert!(measured[3].ends_with("to `extract`, plane by plane, 12.00 times"));
        assert!(measured[4].starts_with("-1.00") && measured[4].contains("-0.50"));
        assert!(measured[6].starts_with("not measured"));
        assert!(measured[7].contains("tilted: "));
        let cells = cells(&claims);
        assert!(cells.iter().all(|line| line.len() == 4));
    }

    #[test]
    fn a_claim_without_its_mappers_says_not_measured() {
        let claims = all(&[], &[], Spread::of(&[1.0]), None);
        let missing = claims
            .iter()
            .filter(|t| t.measured.contains("not measured"));
        assert!(missing.count() >= 6);
    }
}
