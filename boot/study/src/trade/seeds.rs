//! The sources' claims, beside the measurements of this run.
//!
//! The texts are fixed; the figures are those of the run.

use modex::HEIGHT;
use scene::Pose;
use scene::catalogue::Entry;
use texmap::{Mapper, Order};

use super::accuracy::{self, Accuracy, Jobs};
use super::clock;
use super::cost::{ANGLE, LENGTH, Swept};
use super::stats::Spread;
use super::subject::with_poses;
use super::table::{Table, decibels, percent, texels};

/// A claim and its measurement.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The source of the claim.
    pub place: &'static str,
    /// The claim.
    pub claimed: &'static str,
    /// The measured values.
    pub measured: String,
    /// The reason for the difference.
    pub why: &'static str,
}

/// The times of drawing long spans, by the mapper's name.
struct Loops<'a>(&'a [Swept]);

impl Loops<'_> {
    fn time(&self, mapper: &str, order: Order) -> Option<f64> {
        let of = |swept: &&Swept| {
            swept.length == LENGTH
                && swept.angle == ANGLE
                && swept.order == order
                && swept.mapper.to_string() == mapper
        };
        self.0.iter().find(of).map(|swept| swept.cost.time.median)
    }

    fn ratio(&self, slow: (&str, Order), fast: (&str, Order)) -> String {
        match (self.time(slow.0, slow.1), self.time(fast.0, fast.1)) {
            (Some(slow), Some(fast)) => format!("{:.2} times", slow / fast),
            _ => NOT_MEASURED.into(),
        }
    }

    /// Returns the fastest affine column loop, and its time.
    fn best(&self, order: Order) -> Option<(Mapper, f64)> {
        let affine = Mapper::ALL
            .iter()
            .filter(|(_, mapper, _)| matches!(mapper, Mapper::Affine(_)));
        let timed = affine.filter_map(|(name, mapper, _)| Some((*mapper, self.time(name, order)?)));
        timed.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

const NOT_MEASURED: &str = "not measured: its mappers were left out";

/// Angles between the screen's axes and the line of constant depth, in tenths of a degree.
const TILTS: [u32; 7] = [0, 5, 10, 20, 50, 150, 450];

/// Returns the accuracy of the mapper `free-direction` at each of `TILTS`, if the mapper exists.
pub fn tilts() -> Option<Vec<(f64, Accuracy)>> {
    let mapper = Mapper::parse("free-direction")?;
    let entry = Entry::parse("grazing-16")?;
    let mut jobs = Box::new(Jobs::new());
    let tilts = TILTS.map(|tenths| {
        let pose = Pose {
            roll: ((u64::from(tenths) << 32) / 3600) as u32,
            ..entry.pose(0)
        };
        let accuracy = with_poses(entry, &[pose], |subject| {
            accuracy::measure(subject, mapper, &mut jobs)
        });
        (f64::from(tenths) / 10.0, accuracy)
    });
    Some(tilts.to_vec())
}

/// Returns every claim with its measurement.
pub fn trials(
    tables: &[Table],
    swept: &[Swept],
    unrolling: Spread,
    tilts: Option<&[(f64, Accuracy)]>,
) -> Vec<Trial> {
    use Order::{Planes, Polygons};
    let loops = Loops(swept);
    let unit = clock::UNIT;
    let time = |mapper, order| match loops.time(mapper, order) {
        Some(time) => format!("{time:.2}"),
        None => "?".into(),
    };
    let best = match loops.best(Planes) {
        Some((mapper, best)) => match loops.time("row-steps", Polygons) {
            Some(rows) => format!("; to `{mapper}`, plane by plane, {:.2} times", rows / best),
            None => String::new(),
        },
        None => String::new(),
    };
    let step_table = match (
        loops.time("step-table", Polygons),
        loops.time("packed", Polygons),
        loops.time("step-table", Planes),
        loops.time("packed", Planes),
    ) {
        (Some(a), Some(b), Some(c), Some(d)) => {
            format!("{:+.2} {unit} by polygons, {:+.2} by planes", a - b, c - d)
        }
        _ => NOT_MEASURED.into(),
    };
    vec![
        Trial {
            place: "57, listing 57.2",
            claimed: "more than twice as fast as listing 57.1",
            measured: loops.ratio(("row-multiply", Polygons), ("row-steps", Polygons)),
            why: "A multiplication was 13 to 42 cycles and is 3 now, hidden behind other pixels'; a \
                  chain of steps waits for itself. On a card both choose the plane anew for every \
                  pixel.",
        },
        Trial {
            place: "58, of listing 58.1",
            claimed: "nearly 10 % from unrolling",
            measured: format!(
                "{:.1} % from unrolling a loop of shifts and masks eight times",
                100.0 * (1.0 - 1.0 / unrolling.median)
            ),
            why: "A jump that is foreseen costs next to nothing, so that unrolling gains little, or \
                  loses by its own bookkeeping.",
        },
        Trial {
            place: "58, listing 58.2",
            claimed: "columns 2 to 4 times as fast as rows",
            measured: format!(
                "{} by polygons, {} with both by planes",
                loops.ratio(("row-steps", Polygons), ("two-carries", Polygons)),
                loops.ratio(("row-steps", Planes), ("two-carries", Planes)),
            ),
            why: "In RAM there is no OUT, which was most of the gain; down a column every store \
                  meets another line of the cache. On a card the port writes count: a column \
                  takes one, a row one a pixel.",
        },
        Trial {
            place: "58, at the end",
            claimed: "5 to 10 times in all",
            measured: format!(
                "{} from `row-steps` to `packed`, by polygons{best}",
                loops.ratio(("row-steps", Polygons), ("packed", Polygons)),
            ),
            why: "The order of the planes now gains what the loop gained then.",
        },
        Trial {
            place: "58, of John Miles's loop",
            claimed: "a table of two steps costs half a cycle to one more than the branch",
            measured: step_table,
            why: "Carries come as regularly as steps add up, which today's predictors learn: then \
                  the branch is free, as it nearly was. Where they do not learn it, a wrong guess \
                  costs some 15 cycles, and the table none.",
        },
        Trial {
            place: "58, listing 58.3",
            claimed: "packed fractions: from 22 cycles to 10, and 9 without a segment prefix",
            measured: format!(
                "{} from `two-carries` to `packed` ({} {unit}) by polygons, {} ({}) by planes",
                loops.ratio(("two-carries", Polygons), ("packed", Polygons)),
                time("packed", Polygons),
                loops.ratio(("two-carries", Planes), ("packed", Planes)),
                time("packed", Planes),
            ),
            why: "64-bit code has no segments to swap. Two branches that are not foreseen become \
                  one.",
        },
        Trial {
            place: "Free-direction mapping",
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
            why: "The share of wrong texels does not tell: it is the same at any slope but 0 and 45 \
                  degrees, where the lines meet the pixels' centres. At a small slope a line keeps \
                  to one row for long and then jumps, so that the same error shows as long seams.",
        },
        Trial {
            place: "Subdivision",
            claimed: "the quadratic looks better than the linear with fewer pieces",
            measured: quadratic(tables),
            why: "Half as many pieces take as many quotients. Error falls with the cube of a \
                  piece's length in place of its square, while depth changes little in a piece; \
                  near a horizon it does not.",
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
        let told = |accuracy: &Accuracy| {
            let mean = texels(accuracy.errors.mean());
            format!("{mean} ({})", decibels(accuracy.psnr))
        };
        parts.push(format!(
            "{}: {} to {}",
            table.scene,
            told(&quadratic.accuracy),
            told(&linear.accuracy)
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
pub fn cells(trials: &[Trial]) -> Vec<Vec<String>> {
    let head = ["chapter", "claimed", "measured here", "why"].map(String::from);
    let mut cells = vec![head.to_vec()];
    cells.extend(trials.iter().map(|trial| {
        let Trial {
            place,
            claimed,
            measured,
            why,
        } = trial;
        vec![
            (*place).into(),
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
    use crate::trade::cost::Cost;
    use crate::trade::table::tests::made_up;

    fn swept(mapper: &str, order: Order, time: f64) -> Swept {
        let one = Spread::of(&[1.0]);
        Swept {
            length: LENGTH,
            angle: ANGLE,
            mapper: Mapper::parse(mapper).unwrap(),
            order,
            cost: Cost {
                time: Spread::of(&[time]),
                to_bare: one,
                to_packed: one,
            },
        }
    }

    #[test]
    fn trials_tell_the_figures_of_the_run() {
        let mut all = Vec::new();
        for (order, scale) in [(Order::Polygons, 1.0), (Order::Planes, 0.5)] {
            for (mapper, time) in [
                ("row-multiply", 9.0),
                ("row-steps", 6.0),
                ("two-carries", 4.0),
                ("packed", 3.0),
                ("step-table", 2.0),
                ("extract", 1.0),
            ] {
                all.push(swept(mapper, order, time * scale));
            }
        }
        let tables = [made_up("tilted", 1.0)];
        let trials = trials(&tables, &all, Spread::of(&[1.25]), None);
        let measured: Vec<_> = trials.iter().map(|trial| &trial.measured[..]).collect();
        assert_eq!(measured[0], "1.50 times");
        assert!(measured[1].starts_with("20.0 %"));
        assert!(measured[3].ends_with("to `extract`, plane by plane, 12.00 times"));
        assert!(measured[4].starts_with("-1.00") && measured[4].contains("-0.50"));
        assert!(measured[6].starts_with("not measured"));
        assert!(measured[7].contains("tilted: "));
        let cells = cells(&trials);
        assert!(cells.iter().all(|line| line.len() == 4));
    }

    #[test]
    fn what_was_left_out_is_said_to_be() {
        let trials = trials(&[], &[], Spread::of(&[1.0]), None);
        let missing = trials
            .iter()
            .filter(|t| t.measured.contains("not measured"));
        assert!(missing.count() >= 6);
    }
}
