//! Measures the cost of accuracy: the error and the time of every mapper on every scene, as tables, plots
//! and pages.
//!
//! [`run`] measures, and writes these files into a folder:
//!
//! | file | contents |
//! | --- | --- |
//! | `trade.html` | all results, with frames and maps of their errors |
//! | `trade.md`, `trade.csv` | the table, for people and for programs |
//! | `kernel.csv` | the kernel's costs under QEMU |
//! | `sweep.csv` | cost by span length and texture angle |
//! | `error-cost.svg` | error against cost, a point for each mapper, over all scenes |
//! | `error-cost-one.svg` | error against cost on the tilted square alone |
//! | `error-column.svg` | the error along one long column |
//! | `cost-length.svg` | cost against span length |
//! | `images/` | the page's images |

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::builder::PossibleValuesParser;
use model::{Arena, ModelFile};
use scene::catalogue::Entry;
use texmap::{Loop, Mapper, Order};

use crate::measure::{self, KernelFigures};
use system::Progress;
use system::write_atomically;

pub mod accuracy;
pub mod claims;
pub mod clock;
pub mod cost;
pub mod kernel;
pub mod page;
pub mod plot;
pub mod stats;
pub mod table;
pub mod workload;

use accuracy::FrameJobs;
use cost::{Effort, ROUNDS, SWEEPS, SweepPoint};
use page::{Gallery, TradePage};
use plot::{PlotLine, PlotPoint};
use table::{Table, TableRow};
use workload::Workload;

/// The default seed of the random scene. A fixed seed gives the same polygons in every run.
const SEED: u64 = 57;
/// The index of the frame of each scene that is timed.
const TIMED: usize = 1;
/// The scenes whose frames the page shows. It also shows a loaded model, and a scene that is measured alone.
const SHOWN: [&str; 3] = ["tilted", "grazing-16", "cube"];
/// The scene of the plot of errors along a column.
const COLUMN: &str = "tilted";
/// The plot of error against cost on the scene [`COLUMN`].
const ONE_SCENE: &str = "error-cost-one.svg";
/// The mappers of the plot of errors along a column.
const ALONG: [&str; 6] = [
    "affine",
    "linear-32",
    "linear-16",
    "linear-8",
    "quadratic-32",
    "quadratic",
];
/// The mappers of the plot of cost against span length.
const BY_LENGTH: [&str; 8] = [
    "row-steps",
    "packed",
    "step-table",
    "shifts",
    "extract",
    "linear-16",
    "quadratic-16",
    "exact",
];

/// The options of `trade`: what to measure, and the folder for the results.
#[derive(Clone, Debug, clap::Args)]
pub struct TradeOptions {
    /// The folder for the results [default: target/crystal-ball/trade in the workspace]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Measure only these scenes, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = PossibleValuesParser::new(workload::names()))]
    pub scenes: Vec<String>,
    /// Measure only these mappers, separated by commas
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = PossibleValuesParser::new(mapper_names()))]
    pub mappers: Vec<String>,
    /// Spend a twentieth of the time on each value: enough for a first look, not for reliable times
    #[arg(long)]
    quick: bool,
    /// Measure on the host only, without the kernel's costs under QEMU
    #[arg(long)]
    host_only: bool,
    /// The seed of the random polygons
    #[arg(long, value_name = "NUMBER", default_value_t = SEED)]
    seed: u64,
}

fn mapper_names() -> impl Iterator<Item = &'static str> {
    Mapper::ALL.iter().map(|named| named.0)
}

/// Checks that this build gives meaningful measurements.
///
/// # Errors
/// A build with debug assertions, whose times would include the assertions.
pub fn check_build() -> anyhow::Result<()> {
    ensure!(
        !cfg!(debug_assertions),
        "a debug build's times include its checks; use `cargo run --release -- trade`"
    );
    Ok(())
}

/// Measures, writes the results, and returns the page's path. A model is measured beside the requested
/// scenes, or alone if no scene is requested.
///
/// # Errors
/// If the benchmark kernel cannot be run, or a file cannot be written.
pub fn run(
    options: &TradeOptions,
    setup: setup::Options,
    model: Option<&ModelFile<'_>>,
) -> anyhow::Result<PathBuf> {
    let mut arena = in_place::boxed!(Arena);
    let model = model.map(|model_file| model_file.entry(&mut arena));
    let out = match &options.out {
        Some(out) => out.clone(),
        None => setup::folder().join("trade"),
    };
    let chosen = |all: &[String], name: &str| all.is_empty() || all.iter().any(|one| one == name);
    let named = Mapper::ALL.iter();
    let mappers: Vec<Mapper> = named
        .filter(|named| chosen(&options.mappers, named.0))
        .map(|named| named.1)
        .collect();
    let model_alone = model.is_some() && options.scenes.is_empty();
    let scenes: Vec<_> = workload::names()
        .filter(|name| !model_alone && chosen(&options.scenes, name))
        .chain(model.map(|entry| entry.name))
        .collect();
    let effort = match options.quick {
        true => Effort::QUICK,
        false => Effort::FULL,
    };
    fs::create_dir_all(out.join("images"))
        .with_context(|| format!("{}: the folder cannot be created", out.display()))?;
    // The kernel comes first, so that a missing part of the set-up is reported at once.
    let measured = match options.host_only {
        true => None,
        false => Some(measure::run(&measure::MeasureConfig {
            options: setup,
            mappers: mappers.clone(),
            rounds: if options.quick { 1 } else { 5 },
            spans: false,
            ..measure::MeasureConfig::default()
        })?),
    };
    let found = Results {
        kernel: measured,
        ..measure(&scenes, model.as_ref(), &mappers, options.seed, effort)
    };
    let about = about(options, &mappers);
    found.write(&out, &about)?;
    Ok(out.join("trade.html"))
}

/// Returns lines about the run and about the machine.
fn about(options: &TradeOptions, mappers: &[Mapper]) -> Vec<String> {
    let unit = clock::UNIT;
    let mut about = vec![
        format!("On {}.", clock::cpu()),
        format!(
            "Errors are in texels, from the exact quotient at the pixel's centre. Costs are in {unit} \
             a pixel, drawn into RAM: the median of {ROUNDS} rounds ± half the distance from least \
             to most. In brackets: the ratio to a bare load and store a pixel in the same order. \"To \
             packed\": the ratio to `packed` by polygons."
        ),
    ];
    if options.quick {
        about.push("This was a quick run: its times are a first look, not reliable.".into());
    }
    let extract = Mapper::Affine(Loop::Extract);
    if mappers.contains(&extract) {
        about.push(match cost::LesserLoop::of(extract)[..] {
            [_, ..] => "`extract` needs BMI2; \"without\" is its portable reference.".into(),
            [] => "This CPU has no BMI2, so `extract` is its portable reference here.".into(),
        });
    }
    if mappers.contains(&Mapper::Exact) {
        about.push(
            "`exact` uses the widest vector instructions of the CPU; the loops of lesser CPUs, which have \
             the same texels, are beside it."
                .into(),
        );
    }
    about
}

/// The results of all measurements.
#[derive(Debug)]
struct Results {
    /// A table for each scene.
    tables: Vec<Table>,
    galleries: Vec<Gallery>,
    sweep: Vec<SweepPoint>,
    unrolling: stats::Spread,
    tilts: Option<Vec<(f64, accuracy::Accuracy)>>,
    column: Option<(u16, Vec<PlotLine>)>,
    kernel: Option<KernelFigures>,
}

fn measure(
    scenes: &[&str],
    model: Option<&Entry<'_>>,
    mappers: &[Mapper],
    seed: u64,
    effort: Effort,
) -> Results {
    let mut jobs = Box::new(FrameJobs::new());
    let mut tables = Vec::new();
    let mut galleries = Vec::new();
    let mut column = None;
    let mut step = Progress::counting("measuring scenes", scenes.len() as u64);
    for (done, name) in (1..).zip(scenes) {
        let add = |workload: &Workload<'_>| {
            let number = TIMED.min(workload.frames.len() - 1);
            let mut costs = cost::measure(workload, number, mappers, effort).into_iter();
            let rows = mappers.iter().map(|&mapper| TableRow {
                mapper,
                accuracy: accuracy::measure(workload, mapper, &mut jobs),
                costs: costs.by_ref().take(cost::ORDERS.len()).collect(),
            });
            let rows = rows.collect();
            if SHOWN.contains(name) || *name == Entry::LOADED || scenes.len() == 1 {
                galleries.push(Gallery::new(workload, mappers, &mut jobs));
            }
            if *name == COLUMN {
                column = along_column(workload);
            }
            tables.push(Table {
                scene: workload.name.into(),
                about: workload.about.clone(),
                rows,
            });
        };
        match model.filter(|entry| entry.name == *name) {
            Some(entry) => workload::with_entry(entry, add),
            None => workload::with(name, seed, add),
        }
        step.at(done);
    }
    drop(step);
    let mut step = Progress::counting("sweeping span lengths and angles", SWEEPS as u64);
    let mut done = 0;
    let (sweep, unrolling) = workload::with("tilted", seed, |workload| {
        let sweep = cost::sweep(workload, mappers, effort, || {
            done += 1;
            step.at(done);
        });
        (sweep, cost::unrolling(workload, effort))
    });
    drop(step);
    Results {
        tables,
        galleries,
        sweep,
        unrolling,
        tilts: claims::tilts(),
        column,
        kernel: None,
    }
}

/// Returns the longest column of a workload's first frame, and the errors of some mappers along it.
fn along_column(workload: &Workload<'_>) -> Option<(u16, Vec<PlotLine>)> {
    let faces = &workload.frames[0];
    let mut pixels = BTreeMap::new();
    let errors = |mapper, sink: &mut dyn FnMut((u16, u16), f64)| {
        for face in faces {
            let texture = workload.texture(face.face().texture);
            accuracy::errors(mapper, face, texture, |place, error, _| sink(place, error));
        }
    };
    errors(Mapper::Exact, &mut |(x, _), _| {
        *pixels.entry(x).or_insert(0) += 1;
    });
    let (&column, _) = pixels.iter().max_by_key(|&(_, count)| *count)?;
    let lines = ALONG.iter().filter_map(|name| {
        let mut at = BTreeMap::new();
        errors(Mapper::parse(name)?, &mut |(x, y), error| {
            if x == column {
                at.insert(y, error);
            }
        });
        let at = at.into_iter().map(|(y, error)| (f64::from(y), error));
        Some(PlotLine {
            name: (*name).into(),
            at: at.collect(),
        })
    });
    let lines = lines.collect();
    Some((column, lines))
}

impl Results {
    /// Writes all files. The page comes last, so that the files that it names exist.
    fn write(&self, out: &Path, about: &[String]) -> anyhow::Result<()> {
        let put = |name: &str, text: &str| {
            write_atomically(&out.join(name), |file| Ok(file.write_all(text.as_bytes())?))
        };
        let all = Table::all(&self.tables);
        let several = self.tables.len() > 1;
        let mut tables: Vec<&Table> = Vec::new();
        tables.extend(several.then_some(&all));
        tables.extend(&self.tables);
        let plots = self.plots(tables[0])?;
        for (name, _, svg) in &plots {
            put(name, svg)?;
        }
        let claims = claims::all(
            &self.tables,
            &self.sweep,
            self.unrolling,
            self.tilts.as_deref(),
        );
        let claims = claims::cells(&claims);

        let mut extra = vec![(
            String::from("targets"),
            "The project's targets, and the values that this run measured.".to_string(),
            kernel::targets(&self.tables, &self.sweep, self.kernel.as_ref()),
        )];
        if let Some(measured) = &self.kernel {
            let about = format!(
                "In QEMU {}. Instructions are counted under `-icount shift=0`, and accesses of a frame \
                 of the ball on the emulated VGA; both are exact. Times of the whole frame are \
                 measured under plain TCG: the median of the rounds (least to most).",
                measured.qemu
            );
            extra.push(("the kernel".into(), about, kernel::cells(measured)));
            put("kernel.csv", &table::plain_csv(&kernel::cells(measured)))?;
        }
        let mut text = String::from("# What accuracy costs\n\n");
        for line in about {
            text += &format!("{line}\n\n");
        }
        for table in &tables {
            text += &format!("## {}\n\n{}.\n\n", table.scene, table.about);
            text += &table::markdown(&table.cells());
            text.push('\n');
        }
        for (title, about, cells) in &extra {
            text += &format!("## {title}\n\n{about}\n\n");
            text += &table::markdown(cells);
            text.push('\n');
        }
        text += "## The sources' claims, measured\n\n";
        text += &table::markdown(&claims).replace("---:", "---");
        put("trade.md", &text)?;
        put("trade.csv", &table::csv(&self.tables))?;
        put("sweep.csv", &table::sweep_csv(&self.sweep))?;

        let folder = "images";
        for gallery in &self.galleries {
            for shown in &gallery.shown {
                let path = |map| out.join(folder).join(gallery.file(shown, map));
                write_atomically(&path(false), |file| shown.image.write_png(file))?;
                write_atomically(&path(true), |file| shown.heat.write_png(file))?;
            }
        }
        let plots: Vec<_> = plots
            .into_iter()
            .map(|(_, caption, svg)| (caption, svg))
            .collect();
        let cells: Vec<_> = tables
            .iter()
            .map(|table| {
                let about = format!("{}.", table.about);
                (table.scene.clone(), about, table.cells())
            })
            .chain(extra)
            .collect();
        let page = TradePage {
            about,
            plots: &plots,
            galleries: &self.galleries,
            folder,
            tables: &cells,
            claims: &claims,
        };
        put("trade.html", &page.html())
    }

    /// Returns the plots, each with its file, caption and drawing.
    fn plots(&self, table: &Table) -> anyhow::Result<Vec<(&'static str, String, String)>> {
        let unit = clock::UNIT;
        let mut plots = Vec::new();
        // All scenes together, and a scene that is neither the easiest nor the hardest.
        let shown = self.tables.iter().find(|shown| shown.scene == COLUMN);
        let shown = shown.filter(|shown| shown.scene != table.scene);
        for (file, table) in [("error-cost.svg", Some(table)), (ONE_SCENE, shown)] {
            let Some(table) = table else { continue };
            let points = table.rows.iter().map(|row| PlotPoint {
                mapper: row.mapper,
                cost: row.best().frame.time.median,
                error: row.accuracy.errors.percentile(0.99),
                by_planes: row.best().order == Order::Planes,
            });
            let points: Vec<_> = points.collect();
            let svg = plot::error_against_cost(
                [
                    &format!("Error against cost: {}", table.scene),
                    "whole frames in RAM, in the cheaper of the two orders",
                ],
                [
                    &format!("{unit} a pixel"),
                    "error of the 99th percentile, texels",
                ],
                &points,
            )?;
            let caption = "99 of 100 pixels have an error of at most the point's height. Coordinates \
                           are 16.16 fixed point, so the exact mapper's error is at most the last \
                           bit; its texels are exact.";
            plots.push((file, caption.into(), svg));
        }
        if let Some((column, lines)) = &self.column {
            plots.push((
                "error-column.svg",
                "Each mapper is exact where it divides, and deviates between. Errors below 1/65536 \
                 texel are drawn at 1/65536, the last bit of a coordinate."
                    .into(),
                plot::lines(
                    [
                        "The error along one column",
                        &format!("column {column}, the longest of the scene {COLUMN} at tick 0"),
                    ],
                    ["row of the screen", "error, texels"],
                    1.0 / 65_536.0,
                    false,
                    lines,
                )?,
            ));
        }
        let by_length = BY_LENGTH.iter().filter_map(|name| {
            let mapper = Mapper::parse(name)?;
            let of = |point: &&SweepPoint| {
                point.mapper == mapper && point.order == Order::Planes && point.angle == cost::ANGLE
            };
            let mut at: Vec<_> = self
                .sweep
                .iter()
                .filter(of)
                .map(|point| (f64::from(point.length), point.cost.time.median))
                .collect();
            at.sort_by(|a, b| a.0.total_cmp(&b.0));
            (!at.is_empty()).then(|| PlotLine {
                name: (*name).into(),
                at,
            })
        });
        let by_length: Vec<_> = by_length.collect();
        if !by_length.is_empty() {
            plots.push((
                "cost-length.svg",
                "Short spans show what a column costs before its first pixel. The mappers of rows draw \
                 rows as wide as the screen, at any span length."
                    .into(),
                plot::lines(
                    [
                        "Cost against span length",
                        &format!(
                            "drawing alone, plane by plane, the texture at {} degrees",
                            cost::ANGLE
                        ),
                    ],
                    ["pixels in a column's span", &format!("{unit} a pixel")],
                    0.01,
                    true,
                    &by_length,
                )?,
            ));
        }
        Ok(plots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use import::Model;

    #[test]
    fn a_debug_build_refuses() {
        assert_eq!(check_build().is_err(), cfg!(debug_assertions));
    }

    /// Measures and writes everything, with as little work as possible.
    #[test]
    fn a_run_writes_every_file() {
        let out = tempfile::tempdir().unwrap();
        let mappers = ["affine", "packed", "linear-16", "exact"];
        let mappers = mappers.map(|name| Mapper::parse(name).unwrap());
        let effort = Effort { slice: 1 };
        fs::create_dir(out.path().join("images")).unwrap();
        let model = Model::new(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n", None).unwrap();
        let mut arena = in_place::boxed!(Arena);
        let model = model.file().entry(&mut arena);
        let scenes = ["tilted", "wall", model.name];
        let found = measure(&scenes, Some(&model), &mappers, 1, effort);
        found.write(out.path(), &["about".into()]).unwrap();
        let read = |name: &str| fs::read_to_string(out.path().join(name)).unwrap();
        let csv = read("trade.csv");
        assert_eq!(csv.lines().count(), 1 + 3 * 4 * 2);
        assert_eq!(read("sweep.csv").lines().count(), 1 + SWEEPS * 4 * 2);
        let md = read("trade.md");
        for part in [
            "## all scenes",
            "## tilted",
            "## wall",
            "## model",
            "## targets",
            "## The sources' claims, measured",
        ] {
            assert!(md.contains(part), "{part}");
        }
        let html = read("trade.html");
        for name in ["error-cost.svg", "error-column.svg", "cost-length.svg"] {
            let svg = read(name);
            assert!(html.contains(svg.trim()), "{name}");
        }
        // Each image that the page names exists.
        let named = html.split('"').filter(|part| part.starts_with("images/"));
        let mut count = 0;
        for name in named {
            assert!(out.path().join(name).is_file(), "{name}");
            count += 1;
        }
        assert!(count >= 4 && count % 2 == 0);
    }
}
