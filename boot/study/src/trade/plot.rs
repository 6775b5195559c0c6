//! Plots, as SVG.
//!
//! This module computes scales, ticks and the places of names; `plotters` writes the drawing.

use anyhow::anyhow;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use texmap::Mapper;

use super::stats::pareto;

/// A plot's width in SVG's pixels.
const WIDTH: i32 = 1120;
/// A plot's height in SVG's pixels.
const HEIGHT: i32 = 680;
/// The space between the drawing's border and the axes: left, right, top, bottom.
const MARGINS: [i32; 4] = [96, 36, 92, 72];

const INK: RGBColor = RGBColor(0x1B, 0x1B, 0x20);
const SOFT: RGBColor = RGBColor(0x62, 0x62, 0x6E);
const GRID: RGBColor = RGBColor(0xE4, 0xE4, 0xEA);
const FRONT: RGBColor = RGBColor(0xC8, 0x10, 0x4F);
const FONT: &str = "system-ui, 'Liberation Sans', 'DejaVu Sans', sans-serif";

/// The families of mappers, with colours that colour-blind readers can distinguish (after Okabe and Ito).
const FAMILIES: [(&str, RGBColor); 7] = [
    ("affine rows", RGBColor(0xB4, 0x5F, 0x06)),
    ("affine columns", RGBColor(0x00, 0x72, 0xB2)),
    ("linear pieces", RGBColor(0x00, 0x8A, 0x62)),
    ("quadratic pieces", RGBColor(0xB8, 0x4E, 0x95)),
    ("by depth", RGBColor(0x7A, 0x6A, 0x00)),
    ("within an error", RGBColor(0x2F, 0x4B, 0x9A)),
    ("exact", INK),
];

/// Returns the index in [`FAMILIES`] of a mapper's family.
fn family(mapper: Mapper) -> usize {
    match mapper {
        Mapper::Rows(_) => 0,
        Mapper::Affine(_) | Mapper::HalfStep => 1,
        Mapper::Linear(_) => 2,
        Mapper::Quadratic(_) => 3,
        Mapper::Exact => 6,
        _ if mapper.to_string().starts_with("within") => 5,
        _ => 4,
    }
}

/// A mapper in the plot of error against cost.
#[derive(Clone, Debug)]
pub struct PlotPoint {
    /// The mapper.
    pub mapper: Mapper,
    /// The mapper's cost, above zero.
    pub cost: f64,
    /// The mapper's error in texels.
    pub error: f64,
    /// Whether the mapper is cheapest plane by plane.
    pub by_planes: bool,
}

/// A named line in a plot.
#[derive(Clone, Debug)]
pub struct PlotLine {
    /// The line's name.
    pub name: String,
    /// The points: the pixel and the error in texels, or the span length and the cost.
    pub at: Vec<(f64, f64)>,
}

/// An axis with a logarithmic or a linear scale.
#[derive(Clone, Copy, Debug)]
struct PlotAxis {
    from: f64,
    to: f64,
    log: bool,
    /// The positions of `from` and `to` in the drawing.
    pixels: (i32, i32),
}

impl PlotAxis {
    /// Returns an axis that contains some values. A logarithmic axis has some room on both sides of them.
    fn around(values: impl Iterator<Item = f64>, log: bool, pixels: (i32, i32)) -> Self {
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| value.is_finite()) {
            (from, to) = (from.min(value), to.max(value));
        }
        if from > to {
            (from, to) = (1.0, 2.0);
        }
        if log {
            let room = (to / from).powf(0.04).max(1.05);
            (from, to) = (from / room, to * room);
        }
        Self {
            from,
            to,
            log,
            pixels,
        }
    }

    fn scale(&self, value: f64) -> f64 {
        match self.log {
            true => (value / self.from).ln() / (self.to / self.from).ln(),
            false => (value - self.from) / (self.to - self.from),
        }
    }

    fn place(&self, value: f64) -> i32 {
        let (from, to) = (f64::from(self.pixels.0), f64::from(self.pixels.1));
        (from + (to - from) * self.scale(value)).round() as i32
    }

    /// Returns round values on the axis, few enough to be read.
    fn ticks(&self) -> Vec<f64> {
        let mut ticks = Vec::new();
        if self.log {
            let decades = (self.to / self.from).log10();
            let steps: &[f64] = match decades {
                ..1.2 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
                1.2..3.0 => &[1.0, 2.0, 5.0],
                _ => &[1.0],
            };
            let first = self.from.log10().floor() as i32;
            for decade in first..=self.to.log10().ceil() as i32 {
                ticks.extend(steps.iter().map(|step| step * 10f64.powi(decade)));
            }
        } else {
            let rough = (self.to - self.from) / 8.0;
            let decade = 10f64.powf(rough.log10().floor());
            let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
            let step = steps.into_iter().find(|&step| step >= rough);
            let step = step.unwrap_or(rough);
            let first = (self.from / step).ceil() as i64;
            let last = (self.to / step).floor() as i64;
            ticks.extend((first..=last).map(|k| k as f64 * step));
        }
        // A product with a power of ten can be off by a last bit.
        let (from, to) = (self.from - 1e-9, self.to + 1e-9);
        ticks.retain(|tick| (from..=to).contains(tick));
        ticks
    }
}

/// Returns a number as an axis shows it.
fn number(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        ..0.000_009_5 => format!("{value:.0e}"),
        _ => {
            let digits = (1.0 - value.log10().floor()).max(0.0) as usize;
            let text = format!("{value:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').into(),
                false => text,
            }
        }
    }
}

type Drawing<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Returns the error of a drawing that fails.
fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("the plot cannot be drawn: {error}")
}

/// Writes a text whose left end, middle or right end is at a position.
fn write(
    area: &Drawing<'_>,
    text: &str,
    at: (i32, i32),
    size: i32,
    colour: RGBColor,
    h: HPos,
) -> anyhow::Result<()> {
    let style = TextStyle::from((FONT, size).into_font())
        .color(&colour)
        .pos(Pos::new(h, VPos::Center));
    area.draw(&Text::new(text.to_owned(), at, style))
        .map_err(failed)
}

/// Draws the frame of a plot: the title, the axes, their ticks and their names.
fn frame(
    area: &Drawing<'_>,
    title: [&str; 2],
    axes: (&PlotAxis, &PlotAxis),
    names: [&str; 2],
) -> anyhow::Result<()> {
    area.fill(&WHITE).map_err(failed)?;
    let (x, y) = axes;
    write(area, title[0], (MARGINS[0], 26), 20, INK, HPos::Left)?;
    write(area, title[1], (MARGINS[0], 50), 13, SOFT, HPos::Left)?;
    let (left, right) = x.pixels;
    let (bottom, top) = y.pixels;
    let line = |from: (i32, i32), to: (i32, i32), colour: RGBColor| {
        area.draw(&PathElement::new(vec![from, to], colour.stroke_width(1)))
            .map_err(failed)
    };
    for tick in x.ticks() {
        let at = x.place(tick);
        line((at, top), (at, bottom), GRID)?;
        write(
            area,
            &number(tick),
            (at, bottom + 16),
            12,
            SOFT,
            HPos::Center,
        )?;
    }
    for tick in y.ticks() {
        let at = y.place(tick);
        line((left, at), (right, at), GRID)?;
        write(area, &number(tick), (left - 8, at), 12, SOFT, HPos::Right)?;
    }
    line((left, bottom), (right, bottom), SOFT)?;
    line((left, bottom), (left, top), SOFT)?;
    let middle = ((left + right) / 2, bottom + 44);
    write(area, names[0], middle, 14, INK, HPos::Center)?;
    let turned = (FONT, 14).into_font().transform(FontTransform::Rotate270);
    let turned = TextStyle::from(turned)
        .color(&INK)
        .pos(Pos::new(HPos::Center, VPos::Center));
    let at = (left - 70, (top + bottom) / 2);
    area.draw(&Text::new(names[1].to_owned(), at, turned))
        .map_err(failed)
}

/// A rectangle in the drawing: left, top, right, bottom.
type Rect = [i32; 4];

fn overlap(a: Rect, b: Rect) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Returns the approximate width of a text.
fn width(text: &str, size: i32) -> i32 {
    text.chars().count() as i32 * size * 56 / 100 + 2
}

/// Returns a rectangle for the name of each point. The rectangle is near the point and inside `inside`, and
/// covers no other name, no point and no rectangle of `kept_free`. Without free space nearby, the name goes
/// to the right of its point.
fn place_names(
    names: &[String],
    points: &[(i32, i32)],
    size: i32,
    inside: Rect,
    kept_free: &[Rect],
) -> Vec<Rect> {
    let around = |(x, y): (i32, i32)| [x - 6, y - 6, x + 6, y + 6];
    let mut taken: Vec<Rect> = points.iter().map(|&point| around(point)).collect();
    taken.extend(kept_free);
    let mut order: Vec<usize> = (0..points.len()).collect();
    // The names in the most crowded places choose first.
    let crowd = |i: usize| {
        let near =
            |&&(x, y): &&(i32, i32)| (x - points[i].0).abs() < 90 && (y - points[i].1).abs() < 24;
        points.iter().filter(near).count()
    };
    order.sort_by_key(|&i| (std::cmp::Reverse(crowd(i)), points[i].0));
    let mut places = vec![[0; 4]; points.len()];
    for i in order {
        let (x, y) = points[i];
        let (w, h) = (width(&names[i], size), size + 2);
        // Right, left, above, below; then positions further and further away.
        let mut candidates = vec![
            (x + 10, y),
            (x - 10 - w, y),
            (x - w / 2, y - 16),
            (x - w / 2, y + 16),
        ];
        for far in (18..260).step_by(9) {
            for step in 0..24 {
                let angle = f64::from(step) * std::f64::consts::TAU / 24.0;
                let (sin, cos) = angle.sin_cos();
                let (dx, dy) = (f64::from(far) * cos, f64::from(far) * sin);
                let left = if cos < -0.2 {
                    x + dx as i32 - w
                } else if cos > 0.2 {
                    x + dx as i32
                } else {
                    x + dx as i32 - w / 2
                };
                candidates.push((left, y + dy as i32));
            }
        }
        let rect = |(left, middle): (i32, i32)| [left, middle - h / 2, left + w, middle + h / 2];
        let free = |r: &Rect| {
            let within =
                r[0] >= inside[0] && r[1] >= inside[1] && r[2] <= inside[2] && r[3] <= inside[3];
            within && !taken.iter().any(|&other| overlap(*r, other))
        };
        let found = candidates.iter().map(|&at| rect(at)).find(free);
        let place = found.unwrap_or(rect(candidates[0]));
        taken.push(place);
        places[i] = place;
    }
    places
}

/// Plots error against cost, with a point for each mapper and two logarithmic scales. A line joins the
/// mappers that no other mapper beats in both.
///
/// # Errors
/// If the drawing fails.
pub fn error_against_cost(
    title: [&str; 2],
    names: [&str; 2],
    points: &[PlotPoint],
) -> anyhow::Result<String> {
    let (left, right) = (MARGINS[0], WIDTH - MARGINS[1]);
    let (top, bottom) = (MARGINS[2], HEIGHT - MARGINS[3]);
    // The last bit of a coordinate: smaller errors cannot be distinguished.
    let error = |point: &PlotPoint| point.error.max(1.0 / 65_536.0);
    let x = PlotAxis::around(points.iter().map(|p| p.cost), true, (left, right));
    let mut y = PlotAxis::around(points.iter().map(error), true, (bottom, top));
    // Room for names above the mappers with the largest errors, which are many, with similar errors.
    y.to *= (y.to / y.from).powf(0.06);
    let at = |point: &PlotPoint| (x.place(point.cost), y.place(error(point)));
    let mut svg = String::new();
    {
        let area =
            SVGBackend::with_string(&mut svg, (WIDTH as u32, HEIGHT as u32)).into_drawing_area();
        frame(&area, title, (&x, &y), names)?;
        let costs: Vec<_> = points.iter().map(|p| (p.cost, error(p))).collect();
        let mut steps = Vec::new();
        for i in pareto(&costs) {
            let next = at(&points[i]);
            // A step: at a cost between those of two mappers, the best error is that of the cheaper mapper.
            if let Some(&(_, y)) = steps.last() {
                steps.push((next.0, y));
            }
            steps.push(next);
        }
        let kept_free: Vec<Rect> = steps
            .windows(2)
            .map(|ends| {
                let ((a, b), (c, d)) = (ends[0], ends[1]);
                [a.min(c) - 2, b.min(d) - 2, a.max(c) + 2, b.max(d) + 2]
            })
            .collect();
        let stroke = FRONT.mix(0.55).stroke_width(2);
        area.draw(&PathElement::new(steps, stroke))
            .map_err(failed)?;
        let places: Vec<_> = points.iter().map(at).collect();
        let labels: Vec<_> = points.iter().map(|p| p.mapper.to_string()).collect();
        let inside = [left + 4, top, WIDTH - 4, bottom - 4];
        let rects = place_names(&labels, &places, 13, inside, &kept_free);
        for ((point, &(px, py)), (label, rect)) in
            points.iter().zip(&places).zip(labels.iter().zip(&rects))
        {
            let colour = FAMILIES[family(point.mapper)].1;
            let middle = (rect[1] + rect[3]) / 2;
            let near = (px.clamp(rect[0], rect[2]), py.clamp(rect[1], rect[3]));
            let far = (near.0 - px).pow(2) + (near.1 - py).pow(2);
            if far > 14 * 14 {
                let leader = vec![(px, py), near];
                let stroke = colour.mix(0.45).stroke_width(1);
                area.draw(&PathElement::new(leader, stroke))
                    .map_err(failed)?;
            }
            write(&area, label, (rect[0], middle), 13, colour, HPos::Left)?;
        }
        for (point, &place) in points.iter().zip(&places) {
            let colour = FAMILIES[family(point.mapper)].1;
            area.draw(&Circle::new(place, 5, WHITE.filled()))
                .map_err(failed)?;
            let filled = match point.by_planes {
                true => colour.filled(),
                false => colour.stroke_width(2),
            };
            area.draw(&Circle::new(place, 5, filled)).map_err(failed)?;
        }
        legend(&area, points)?;
        area.present().map_err(failed)?;
    }
    Ok(svg)
}

/// Draws the legend: the families in the plot, the two marks, and the front.
fn legend(area: &Drawing<'_>, points: &[PlotPoint]) -> anyhow::Result<()> {
    let (mut x, y) = (MARGINS[0], 74);
    for (i, (name, colour)) in FAMILIES.iter().enumerate() {
        if points.iter().any(|point| family(point.mapper) == i) {
            area.draw(&Circle::new((x + 5, y), 5, colour.filled()))
                .map_err(failed)?;
            write(area, name, (x + 15, y), 12, SOFT, HPos::Left)?;
            x += width(name, 12) + 24;
        }
    }
    for (text, filled) in [("cheapest by planes", true), ("by polygons", false)] {
        let mark = match filled {
            true => SOFT.filled(),
            false => SOFT.stroke_width(2),
        };
        area.draw(&Circle::new((x + 5, y), 5, mark))
            .map_err(failed)?;
        write(area, text, (x + 15, y), 12, SOFT, HPos::Left)?;
        x += width(text, 12) + 24;
    }
    let stroke = FRONT.mix(0.55).stroke_width(2);
    area.draw(&PathElement::new(vec![(x, y), (x + 22, y)], stroke))
        .map_err(failed)?;
    write(area, "best", (x + 28, y), 12, SOFT, HPos::Left)
}

/// Colours of lines that colour-blind readers can distinguish.
const LINES: [RGBColor; 8] = [
    RGBColor(0xB4, 0x5F, 0x06),
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0x00, 0x8A, 0x62),
    RGBColor(0xB8, 0x4E, 0x95),
    RGBColor(0x7A, 0x6A, 0x00),
    INK,
    RGBColor(0xC8, 0x10, 0x4F),
    RGBColor(0x4B, 0x8B, 0xC8),
];

/// Plots lines over a common axis, with a logarithmic vertical scale. Values below `least` are drawn at
/// `least`. Each line's name stands to the right of its end.
///
/// # Errors
/// If the drawing fails.
pub fn lines(
    title: [&str; 2],
    names: [&str; 2],
    least: f64,
    log_x: bool,
    lines: &[PlotLine],
) -> anyhow::Result<String> {
    let room = 118;
    let (left, right) = (MARGINS[0], WIDTH - MARGINS[1] - room);
    let (top, bottom) = (MARGINS[2] - 14, HEIGHT - MARGINS[3]);
    let all = || lines.iter().flat_map(|line| &line.at);
    let x = PlotAxis::around(all().map(|at| at.0), log_x, (left, right));
    let y = PlotAxis::around(all().map(|at| at.1.max(least)), true, (bottom, top));
    let mut svg = String::new();
    {
        let area =
            SVGBackend::with_string(&mut svg, (WIDTH as u32, HEIGHT as u32)).into_drawing_area();
        frame(&area, title, (&x, &y), names)?;
        let mut ends = Vec::new();
        for (line, colour) in lines.iter().zip(LINES.iter().cycle()) {
            let at = |&(px, value): &(f64, f64)| (x.place(px), y.place(value.max(least)));
            let path: Vec<_> = line.at.iter().map(at).collect();
            // A name goes to the mean height of the line's last tenth.
            let tail = &path[path.len() * 9 / 10..];
            let height = tail.iter().map(|p| p.1).sum::<i32>() / tail.len().max(1) as i32;
            ends.push((height, &line.name, *colour));
            area.draw(&PathElement::new(path, colour.stroke_width(2)))
                .map_err(failed)?;
        }
        // From the top down, each name is at least one line of text below the one before it; then the names
        // that are too low move up from the bottom.
        ends.sort_by_key(|end| end.0);
        for i in 1..ends.len() {
            ends[i].0 = ends[i].0.max(ends[i - 1].0 + 17);
        }
        let mut limit = bottom;
        for end in ends.iter_mut().rev() {
            end.0 = end.0.min(limit);
            limit = end.0 - 17;
        }
        for (height, name, colour) in ends {
            let mark = vec![(right + 8, height), (right + 24, height)];
            area.draw(&PathElement::new(mark, colour.stroke_width(3)))
                .map_err(failed)?;
            write(&area, name, (right + 30, height), 13, colour, HPos::Left)?;
        }
        area.present().map_err(failed)?;
    }
    Ok(svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(mapper: Mapper, cost: f64, error: f64) -> PlotPoint {
        PlotPoint {
            mapper,
            cost,
            error,
            by_planes: true,
        }
    }

    #[test]
    fn a_name_overlaps_no_other_name_and_no_point() {
        let mut random = seeded::generator();
        let inside = [60, 60, 1000, 600];
        for _ in 0..20 {
            // As crowded as the affine loops, which have the same error and nearly the same cost.
            let points: Vec<_> = (0..26)
                .map(|_| (random.i32(100..900), 100 + 90 * random.i32(0..5)))
                .collect();
            let names = Mapper::ALL.iter().map(|named| named.0.to_string());
            let names: Vec<_> = names.cycle().take(points.len()).collect();
            let places = place_names(&names, &points, 13, inside, &[]);
            for (i, &a) in places.iter().enumerate() {
                let within = a[0] >= 60 && a[1] >= 60 && a[2] <= 1000 && a[3] <= 600;
                assert!(within, "{a:?}");
                for &b in &places[..i] {
                    assert!(!overlap(a, b), "{a:?} and {b:?}");
                }
                for &(x, y) in &points {
                    assert!(!overlap(a, [x - 5, y - 5, x + 5, y + 5]), "{a:?}");
                }
            }
        }
    }

    #[test]
    fn an_axis_has_3_to_12_round_ticks() {
        for (from, to, log) in [
            (1.1, 30.0, true),
            (0.9, 4.0, true),
            (1e-5, 300.0, true),
            (0.0, 239.0, false),
        ] {
            let axis = PlotAxis {
                from,
                to,
                log,
                pixels: (0, 1000),
            };
            let ticks = axis.ticks();
            assert!((3..=12).contains(&ticks.len()), "{ticks:?}");
            assert!(ticks.is_sorted());
            let inside = |tick: &f64| (0..=1000).contains(&axis.place(*tick));
            assert!(ticks.iter().all(inside), "{ticks:?}");
        }
        for (value, text) in [
            (1.5, "1.5"),
            (20.0, "20"),
            (0.001, "0.001"),
            (1e-5, "0.00001"),
            (1e-6, "1e-6"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn the_plot_of_error_against_cost_names_every_mapper() {
        let all = Mapper::ALL.iter().zip(1..);
        let points: Vec<_> = all
            .map(|(named, i)| point(named.1, f64::from(i), 100.0 / f64::from(i)))
            .collect();
        let svg = error_against_cost(["a", "b"], ["c", "d"], &points).unwrap();
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
        for (name, ..) in Mapper::ALL {
            assert!(svg.contains(&format!("\n{name}\n")), "{name}");
        }
        // Each point is two circles: a white disc, and the mark on it.
        assert!(svg.matches("<circle").count() >= 2 * points.len());
    }

    #[test]
    fn the_plot_of_lines_names_every_line() {
        let line = |name: &str, scale: f64| PlotLine {
            name: name.into(),
            at: (0..50)
                .map(|i| (f64::from(i), scale * f64::from(i)))
                .collect(),
        };
        let two = [line("one", 0.1), line("two", 0.2)];
        let svg = lines(["a", "b"], ["c", "d"], 1e-5, false, &two).unwrap();
        assert!(svg.contains("\none\n") && svg.contains("\ntwo\n"));
        assert!(svg.matches("<polyline").count() >= 2);
    }
}
