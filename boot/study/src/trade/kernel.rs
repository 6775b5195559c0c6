//! The benchmark kernel's figures as a table, and the targets beside the measurements.

use bench::Work;
use texmap::{Mapper, Order, Quotients};

use super::cost::{LesserLoop, LongSpans, SweepPoint};
use super::table::Table;
use crate::measure::{Cpu, KernelFigures, KernelRow, TimeRatio};

/// Returns the kernel's table: a row for each mapper in each order, with the figures of the baseline CPU
/// model, and the instructions of the other model.
pub fn cells(measured: &KernelFigures) -> Vec<Vec<String>> {
    let head = [
        "mapper",
        "order",
        "instructions a pixel, screen",
        "instructions a pixel, screen, with bit-extract",
        "instructions a pixel, ball",
        "port writes",
        "stores",
        "loads",
        "time over bare stores",
        "time over presenting",
    ];
    let mut cells = vec![head.map(String::from).to_vec()];
    for row in of(measured, Cpu::Baseline) {
        let max = of(measured, Cpu::Max);
        let max = max
            .iter()
            .find(|other| other.mapper == row.mapper && other.order == row.order);
        let accesses = &row.accesses;
        let sum = |part: fn(&modex::Tally) -> u64| {
            part(&accesses.draw) + part(&accesses.erase) + part(&accesses.flip)
        };
        cells.push(vec![
            row.mapper.to_string(),
            row.order.to_string(),
            format!("{:.2}", row.instructions_a_pixel()),
            max.map_or(String::new(), |max| {
                format!("{:.2}", max.instructions_a_pixel())
            }),
            format!("{:.1}", row.cost(row.whole_frame()).instructions_a_pixel()),
            sum(|tally| tally.ports).to_string(),
            sum(|tally| tally.stores).to_string(),
            accesses.loads.to_string(),
            spread(row.frame_over_bare()),
            spread(row.frame_over_present()),
        ]);
    }
    cells
}

fn spread(ratio: TimeRatio) -> String {
    let TimeRatio {
        median,
        least,
        most,
        ..
    } = ratio;
    format!("{median:.2} ({least:.2} to {most:.2})")
}

fn of(measured: &KernelFigures, cpu: Cpu) -> &[KernelRow] {
    let on = measured.cpus.iter().find(|on| on.cpu == cpu);
    on.map_or(&[], |on| &on.rows)
}

/// Returns the targets, the measured values, and whether each target is met.
pub fn targets(
    tables: &[Table],
    sweep: &[SweepPoint],
    measured: Option<&KernelFigures>,
) -> Vec<Vec<String>> {
    let mut cells = vec![
        ["figure", "target", "measured", ""]
            .map(String::from)
            .to_vec(),
    ];
    let mut add = |what: &str, target: f64, most: bool, figure: Option<f64>| {
        let bound = if most { "at most" } else { "at least" };
        let measured = figure.map_or("not measured".into(), |figure| format!("{figure:.2}"));
        let met = match figure.map(|figure| {
            if most {
                figure <= target
            } else {
                figure >= target
            }
        }) {
            Some(true) => "met",
            Some(false) => "missed",
            None => "",
        };
        let target = format!("{bound} {target}");
        cells.push(vec![what.into(), target, measured, met.into()]);
    };
    let spans = LongSpans(sweep);
    let frame_time = |scene, mapper| frame_time(tables, scene, mapper);
    add(
        "best affine column loop by planes, over a bare load and store",
        1.0,
        true,
        spans
            .fastest_affine(Order::Planes)
            .map(|point| point.cost.to_bare.median),
    );
    let best = spans
        .fastest_affine(Order::Planes)
        .map(|point| point.cost.time.median);
    let exact = [
        (None, 2.1, "with AVX-512"),
        (Some(Quotients::Avx2), 3.4, "with AVX2"),
        (Some(Quotients::Guess), 4.5, "with neither"),
    ];
    for (way, target, cpu) in exact {
        // On a CPU without AVX-512 the mapper's own loop is another.
        let way = match (way, Quotients::fastest()) {
            (None, Quotients::Avx512) => None,
            (None, _) => continue,
            (Some(way), fastest) if way == fastest => None,
            (way, _) => way,
        };
        add(
            &format!("`exact` over the best affine loop {cpu}, mean of tilted, cube and floor"),
            target,
            true,
            exact_over_affine(tables, way),
        );
    }
    // Polygon by polygon, because plane by plane the mappers of rows do not draw rows as their names say.
    let screen = |cpu, mapper: fn(Mapper) -> bool| -> Option<f64> {
        let rows = of(measured?, cpu).iter();
        let figures = rows
            .filter(|row| mapper(row.mapper) && row.order == Order::Polygons)
            .map(KernelRow::instructions_a_pixel);
        figures.min_by(f64::total_cmp)
    };
    let affine = |mapper| matches!(mapper, Mapper::Affine(_));
    let multiply = |mapper| Some(mapper) == Mapper::parse("row-multiply");
    add(
        "`row-multiply` over the best affine column, kernel instructions",
        5.0,
        false,
        over(screen(Cpu::Max, multiply), screen(Cpu::Max, affine)),
    );
    let what = "instructions a pixel of the best affine loop, full screen, set-up included";
    add(what, 6.6, true, screen(Cpu::Baseline, affine));
    let what = "instructions a pixel of the best affine loop with bit-extract, full screen, set-up included";
    add(what, 4.6, true, screen(Cpu::Max, affine));
    let what = "instructions a pixel of `exact`, full screen, set-up included";
    let exact = |mapper| mapper == Mapper::Exact;
    add(what, 20.0, true, screen(Cpu::Baseline, exact));
    let over_bare = |mapper: fn(Mapper) -> bool| -> Option<f64> {
        let rows = of(measured?, Cpu::Baseline).iter();
        let times = rows
            .filter(|row| mapper(row.mapper))
            .map(|row| row.ratio(Work::ScreenRam, Work::BareRam).median);
        times.min_by(f64::total_cmp)
    };
    let what = "`exact` over the best affine loop under TCG, full screen in RAM";
    add(what, 2.8, true, over(over_bare(exact), over_bare(affine)));
    let ball = |order| -> Option<f64> {
        let rows = of(measured?, Cpu::Baseline).iter();
        let mut rows = rows.filter(|row| row.mapper == Mapper::default() && row.order == order);
        let row = rows.next()?;
        Some(row.cost(row.whole_frame()).instructions_a_pixel())
    };
    let what = "instructions a pixel of a frame of the ball, by polygons";
    add(what, 40.0, true, ball(Order::Polygons));
    add(
        "`linear-16` over the best affine loop, by planes",
        1.6,
        true,
        over(spans.time("linear-16", Order::Planes), best),
    );
    add(
        "`within-1/2` over `affine` on the ball, whole frames",
        1.15,
        true,
        over(
            frame_time("ball", "within-1/2"),
            frame_time("ball", "affine"),
        ),
    );
    add(
        "`within-1/2` on the grazing floor in RAM, cycles a pixel",
        1.4,
        true,
        loop_time(tables, "grazing-16", |mapper| {
            Some(mapper) == Mapper::parse("within-1/2")
        }),
    );
    let masks = |order| -> Option<f64> {
        let rows = of(measured?, Cpu::Baseline).iter();
        let mut rows = rows.filter(|row| row.mapper == Mapper::default() && row.order == order);
        Some(rows.next()?.accesses.draw.map_mask as f64)
    };
    let what = "Map Mask writes of a frame of the ball by planes, drawing";
    add(what, 4.0, true, masks(Order::Planes));
    let frame = |ratio: fn(&KernelRow) -> f64| -> Option<f64> {
        let rows = of(measured?, Cpu::Baseline).iter().map(ratio);
        rows.min_by(f64::total_cmp)
    };
    add(
        "frame of the ball under TCG over bare byte stores of its pixels, fastest mapper",
        0.75,
        true,
        frame(|row| row.frame_over_bare().median),
    );
    cells
}

fn over(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    Some(a? / b?)
}

/// Returns the least time of drawing a scene alone, among the mappers that `is_meant` accepts.
fn loop_time(tables: &[Table], scene: &str, is_meant: fn(Mapper) -> bool) -> Option<f64> {
    let table = tables.iter().find(|table| table.scene == scene)?;
    let rows = table.rows.iter().filter(|row| is_meant(row.mapper));
    let costs = rows.flat_map(|row| &row.costs);
    let times = costs.map(|costs| costs.loops.time.median);
    times.min_by(f64::total_cmp)
}

/// Returns the time of the exact mapper over that of the best affine loop, as the mean over three scenes.
/// `way` is a way of a lesser CPU; nothing stands for the mapper's own loop.
fn exact_over_affine(tables: &[Table], way: Option<Quotients>) -> Option<f64> {
    let scenes = ["tilted", "cube", "grazing-16"];
    let ratios = scenes.map(|scene| {
        let affine = loop_time(tables, scene, |mapper| matches!(mapper, Mapper::Affine(_)))?;
        let table = tables.iter().find(|table| table.scene == scene)?;
        let row = table.rows.iter().find(|row| row.mapper == Mapper::Exact)?;
        let times = row.costs.iter().filter_map(|costs| match way {
            None => Some(costs.loops.time.median),
            Some(way) => {
                let mut lesser = costs.lesser.iter();
                let (_, cost) = lesser.find(|(by, _)| *by == LesserLoop::Quotients(way))?;
                Some(cost.time.median)
            }
        });
        Some(times.min_by(f64::total_cmp)? / affine)
    });
    let sum: Option<f64> = ratios.into_iter().sum();
    sum.map(|sum| sum / scenes.len() as f64)
}

/// Returns the time of a scene's frame in RAM, in the cheaper of the orders.
fn frame_time(tables: &[Table], scene: &str, mapper: &str) -> Option<f64> {
    let table = tables.iter().find(|table| table.scene == scene)?;
    let row = table.rows.iter().find(|row| row.name() == mapper)?;
    Some(row.best().frame.time.median)
}
