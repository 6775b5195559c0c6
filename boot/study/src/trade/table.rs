//! The figures as tables, for people (Markdown) and for programs (CSV).

use std::fmt::Write as _;

use texmap::{Mapper, Order};

use super::accuracy::Accuracy;
use super::clock;
#[cfg(test)]
use super::cost::LesserLoop;
use super::cost::{MapperCost, PixelCost, SweepPoint};
use super::stats::Spread;

/// A mapper's figures on one scene, or on all scenes.
#[derive(Clone, Debug)]
pub struct TableRow {
    /// The mapper.
    pub mapper: Mapper,
    /// The mapper's accuracy.
    pub accuracy: Accuracy,
    /// The mapper's cost in each of [`ORDERS`](super::cost::ORDERS).
    pub costs: Vec<MapperCost>,
}

impl TableRow {
    /// Returns the name of the mapper.
    pub fn name(&self) -> String {
        self.mapper.to_string()
    }

    /// Returns the costs in the order that draws whole frames fastest.
    ///
    /// # Panics
    /// If the row has no costs.
    pub fn best(&self) -> &MapperCost {
        let cost = |costs: &&MapperCost| costs.frame.time.median;
        let best = self.costs.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        best.expect("the row has costs")
    }

    /// Returns the costs in an order.
    ///
    /// # Panics
    /// If the order was not measured.
    pub fn costs(&self, order: Order) -> &MapperCost {
        let found = self.costs.iter().find(|costs| costs.order == order);
        found.expect("every order was measured")
    }
}

/// The figures of all mappers on a scene.
#[derive(Clone, Debug)]
pub struct Table {
    /// The scene's name.
    pub scene: String,
    /// A line about the scene.
    pub about: String,
    /// A row for each mapper.
    pub rows: Vec<TableRow>,
}

impl Table {
    /// Joins the tables of several scenes: errors together, costs as geometric means.
    pub fn all(tables: &[Self]) -> Self {
        let mut rows = Vec::new();
        let mappers = tables.first().map_or(&[][..], |table| &table.rows);
        for (i, first) in mappers.iter().enumerate() {
            let same: Vec<&TableRow> = tables.iter().map(|table| &table.rows[i]).collect();
            let mut accuracy = first.accuracy.clone();
            same[1..]
                .iter()
                .for_each(|row| accuracy.extend(&row.accuracy));
            let mean = |k: usize, part: &dyn Fn(&MapperCost) -> PixelCost| {
                let parts = |spread: fn(&PixelCost) -> Spread| {
                    let all: Vec<Spread> = same
                        .iter()
                        .map(|row| spread(&part(&row.costs[k])))
                        .collect();
                    Spread::mean(&all)
                };
                PixelCost {
                    time: parts(|cost| cost.time),
                    to_bare: parts(|cost| cost.to_bare),
                    to_packed: parts(|cost| cost.to_packed),
                }
            };
            let costs = first.costs.iter().enumerate().map(|(k, costs)| MapperCost {
                loops: mean(k, &|costs| costs.loops),
                frame: mean(k, &|costs| costs.frame),
                lesser: (costs.lesser.iter().enumerate())
                    .map(|(i, &(by, _))| (by, mean(k, &|costs| costs.lesser[i].1)))
                    .collect(),
                ..costs.clone()
            });
            rows.push(TableRow {
                mapper: first.mapper,
                accuracy,
                costs: costs.collect(),
            });
        }
        let names: Vec<_> = tables.iter().map(|table| &table.scene[..]).collect();
        Self {
            scene: "all scenes".into(),
            about: format!(
                "{}: errors together, costs as geometric means",
                names.join(", ")
            ),
            rows,
        }
    }

    /// Returns the table's header and rows, cell by cell.
    pub fn cells(&self) -> Vec<Vec<String>> {
        let mut head: Vec<String> = ["mapper", "largest", "99 %", "mean", "other texels", "PSNR"]
            .map(String::from)
            .to_vec();
        head.extend([
            "loops, polygons".into(),
            "loops, planes".into(),
            "frame, polygons".into(),
            "frame, planes".into(),
            "frame to packed".into(),
        ]);
        let mut cells = vec![head];
        for row in &self.rows {
            let accuracy = &row.accuracy;
            let mut line = vec![
                row.name(),
                texels(accuracy.errors.largest()),
                texels(accuracy.errors.percentile(0.99)),
                texels(accuracy.errors.mean()),
                percent(accuracy.other_share()),
                decibels(accuracy.psnr),
            ];
            let parts: [fn(&MapperCost) -> PixelCost; 2] =
                [|costs| costs.loops, |costs| costs.frame];
            for part in parts {
                line.extend(row.costs.iter().map(|costs| {
                    let PixelCost { time, to_bare, .. } = part(costs);
                    format!(
                        "{:.2} ± {:.2} ({:.2})",
                        time.median,
                        time.half(),
                        to_bare.median
                    )
                }));
            }
            line.push(format!("{:.2}", row.best().frame.to_packed.median));
            for (k, costs) in row.costs.iter().enumerate() {
                for (by, cost) in &costs.lesser {
                    // The columns of the loops follow the six columns of the name and the accuracy.
                    line[6 + k] += &format!("; {:.2} {}", cost.time.median, by.label());
                }
            }
            cells.push(line);
        }
        cells
    }
}

/// Returns rows of cells as a Markdown table, with the first column aligned left and the others right.
pub fn markdown(cells: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (i, line) in cells.iter().enumerate() {
        let line: Vec<_> = line.iter().map(|cell| cell.replace('|', "\\|")).collect();
        let _ = writeln!(text, "| {} |", line.join(" | "));
        if i == 0 {
            let rules = line.iter().enumerate();
            let rules: Vec<_> = rules
                .map(|(k, _)| if k == 0 { "---" } else { "---:" })
                .collect();
            let _ = writeln!(text, "| {} |", rules.join(" | "));
        }
    }
    text
}

/// Returns an error in texels, with its significant digits.
pub fn texels(error: f64) -> String {
    match error {
        0.0 => "0".into(),
        100.0.. => format!("{error:.0}"),
        10.0.. => format!("{error:.1}"),
        1.0.. => format!("{error:.2}"),
        0.1.. => format!("{error:.3}"),
        0.01.. => format!("{error:.4}"),
        0.0001.. => format!("{error:.5}"),
        // Enough digits for the last bit of a coordinate.
        _ => format!("{error:.6}"),
    }
}

/// Returns a share in per cent.
pub fn percent(share: f64) -> String {
    match 100.0 * share {
        0.0 => "0".into(),
        percent if percent < 0.01 => "< 0.01 %".into(),
        percent if percent < 10.0 => format!("{percent:.2} %"),
        percent => format!("{percent:.1} %"),
    }
}

/// Returns decibels, or `equal` for frames without a difference.
pub fn decibels(psnr: f64) -> String {
    match psnr.is_finite() {
        true => format!("{psnr:.1} dB"),
        false => "equal".into(),
    }
}

/// Returns rows of cells as CSV.
pub fn plain_csv(cells: &[Vec<String>]) -> String {
    let line = |cells: &Vec<String>| {
        let fields: Vec<_> = cells.iter().map(|cell| field(cell)).collect();
        fields.join(",") + "\n"
    };
    cells.iter().map(line).collect()
}

/// Returns all figures as CSV: a line for each scene, mapper and order.
pub fn csv(tables: &[Table]) -> String {
    let mut text =
        String::from("scene,mapper,order,unit,pixels,largest_error,p99_error,mean_error");
    text += ",other_texels,psnr_db";
    for what in ["loops", "frame"] {
        for part in ["time", "time_to_bare", "time_to_packed"] {
            for of in ["", "_least", "_most"] {
                let _ = write!(text, ",{what}_{part}{of}");
            }
        }
    }
    text += ",loops_time_on_lesser_cpus";
    text.push('\n');
    for table in tables {
        for row in &table.rows {
            let accuracy = &row.accuracy;
            for costs in &row.costs {
                let _ = write!(
                    text,
                    "{},{},{},{},{},{},{},{},{},{}",
                    field(&table.scene),
                    field(&row.name()),
                    costs.order,
                    clock::UNIT,
                    accuracy.errors.count(),
                    accuracy.errors.largest(),
                    accuracy.errors.percentile(0.99),
                    accuracy.errors.mean(),
                    accuracy.other_texels,
                    accuracy.psnr,
                );
                for cost in [costs.loops, costs.frame] {
                    for spread in [cost.time, cost.to_bare, cost.to_packed] {
                        let Spread {
                            median,
                            least,
                            most,
                        } = spread;
                        let _ = write!(text, ",{median:.4},{least:.4},{most:.4}");
                    }
                }
                text.push(',');
                let lesser = costs.lesser.iter();
                let lesser: Vec<_> = lesser
                    .map(|(by, cost)| format!("{:.4} {}", cost.time.median, by.label()))
                    .collect();
                text.push_str(&lesser.join("; "));
                text.push('\n');
            }
        }
    }
    text
}

/// Returns the sweeps over span lengths and angles as CSV.
pub fn sweep_csv(sweep: &[SweepPoint]) -> String {
    let mut text = String::from("length,angle,mapper,order,unit,time,time_least,time_most");
    text += ",time_to_bare,time_to_packed\n";
    for at in sweep {
        let Spread {
            median,
            least,
            most,
        } = at.cost.time;
        let _ = writeln!(
            text,
            "{},{},{},{},{},{median:.4},{least:.4},{most:.4},{:.4},{:.4}",
            at.length,
            at.angle,
            field(&at.mapper.to_string()),
            at.order,
            clock::UNIT,
            at.cost.to_bare.median,
            at.cost.to_packed.median
        );
    }
    text
}

/// Returns a field of a CSV file, quoted if necessary.
fn field(text: &str) -> String {
    match text.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.into(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Returns a table of made-up figures.
    pub fn made_up(scene: &str, scale: f64) -> Table {
        let mut rows = Vec::new();
        for (i, &(_, mapper, _)) in Mapper::ALL.iter().enumerate() {
            let mut accuracy = Accuracy {
                psnr: 30.0 + i as f64,
                ..Accuracy::default()
            };
            let mut errors = fastrand::Rng::with_seed(i as u64);
            for _ in 0..100 {
                accuracy
                    .errors
                    .add(errors.f64() * scale * 0.7f64.powi(i as i32));
            }
            let cost = |time: f64| PixelCost {
                time: Spread::of(&[time, time * 1.1, time * 0.95]),
                to_bare: Spread::of(&[time / 2.0]),
                to_packed: Spread::of(&[time / 3.0]),
            };
            let costs = super::super::cost::ORDERS.map(|order| MapperCost {
                mapper,
                order,
                loops: cost(1.0 + i as f64),
                frame: cost(2.0 + i as f64 * scale),
                lesser: LesserLoop::of(mapper)
                    .into_iter()
                    .map(|by| (by, cost(7.0)))
                    .collect(),
            });
            rows.push(TableRow {
                mapper,
                accuracy,
                costs: costs.to_vec(),
            });
        }
        Table {
            scene: scene.into(),
            about: "made up".into(),
            rows,
        }
    }

    #[test]
    fn every_line_of_the_csv_has_the_same_number_of_fields() {
        let tables = [made_up("a", 1.0), made_up("b,\"c\"", 2.0)];
        let text = csv(&tables);
        let mut lines = text.lines();
        let fields = |line: &str| line.replace("\"b,\"\"c\"\"\"", "b").split(',').count();
        let head = lines.next().unwrap();
        assert_eq!(fields(head), 10 + 18 + 1);
        let mut count = 0;
        for line in lines {
            assert_eq!(fields(line), fields(head), "{line}");
            count += 1;
        }
        assert_eq!(count, 2 * Mapper::ALL.len() * 2);
        assert!(text.ends_with('\n') && !text.contains("\n\n"));
    }

    #[test]
    fn every_line_of_the_markdown_has_the_same_number_of_cells() {
        let table = made_up("a", 1.0);
        let text = markdown(&table.cells());
        let bars = |line: &str| line.matches('|').count();
        let head = text.lines().next().unwrap();
        assert_eq!(bars(head), 12);
        assert!(text.lines().all(|line| bars(line) == 12));
        assert_eq!(text.lines().count(), 2 + Mapper::ALL.len());
    }

    #[test]
    fn a_joined_table_has_all_errors_and_the_mean_costs() {
        let tables = [made_up("a", 1.0), made_up("b", 4.0)];
        let all = Table::all(&tables);
        for (i, row) in all.rows.iter().enumerate() {
            let of = |k: usize| &tables[k].rows[i];
            assert_eq!(row.accuracy.errors.count(), 200);
            assert_eq!(
                row.accuracy.errors.largest(),
                of(1).accuracy.errors.largest()
            );
            let product = of(0).costs[0].frame.time.median * of(1).costs[0].frame.time.median;
            let mean = row.costs[0].frame.time.median;
            assert!((mean * mean / product - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn figures_are_printed_with_their_significant_digits() {
        for (error, text) in [
            (0.0, "0"),
            (123.4, "123"),
            (12.34, "12.3"),
            (1.234, "1.23"),
            (0.1234, "0.123"),
            (0.00123, "0.00123"),
            (0.000_015, "0.000015"),
        ] {
            assert_eq!(texels(error), text);
        }
        assert_eq!(percent(0.1234), "12.3 %");
        assert_eq!(percent(0.00001), "< 0.01 %");
        assert_eq!(decibels(f64::INFINITY), "equal");
    }
}
