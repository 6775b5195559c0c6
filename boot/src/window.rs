//! Enlarges QEMU's window.
//!
//! QEMU opens its window at the size of the VGA's image, 640 x 480, and has no option for another size. So
//! QEMU is set to scale its display (GTK has an option for that, SDL always scales), and this module
//! enlarges the window, as a pager or a window manager would. It uses X11's protocol. A Wayland compositor
//! lets no program resize another program's window: there the window opens as before, and the user enlarges
//! it.

use x11rb::connection::Connection;
use x11rb::protocol::randr::ConnectionExt as _;
use x11rb::protocol::xproto::{AtomEnum, ConfigureWindowAux, ConnectionExt as _, MapState, Window};
use x11rb::rust_connection::RustConnection;

/// A rectangle of the screen, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Rectangle {
    x: i32,
    y: i32,
    width: u32,
    height: u32,
}

/// The largest part of a monitor's width and height that the frame gets, in fifths: title bars and panels
/// need the rest.
const FIFTHS: u32 = 4;
/// The size of Mode X's frame. At a whole multiple of this size all pixels are equally large.
const FRAME: (u32, u32) = (320, 240);

/// Enlarges the window of QEMU's process, if the window exists and has the size that QEMU gave it.
///
/// # Errors
/// If no X server is found, or the server refuses a request. The window keeps its size.
pub fn enlarge(process: u32) -> anyhow::Result<()> {
    let (x, screen) = x11rb::connect(None)?;
    let root = x.setup().roots[screen].root;
    let Some(window) = find(&x, root, process)? else {
        return Ok(());
    };
    let geometry = x.get_geometry(window)?.reply()?;
    let place = x.translate_coordinates(window, root, 0, 0)?.reply()?;
    let now = Rectangle {
        x: place.dst_x.into(),
        y: place.dst_y.into(),
        width: geometry.width.into(),
        height: geometry.height.into(),
    };
    let monitors = x.randr_get_monitors(root, true)?.reply()?.monitors;
    let monitors = monitors.iter().map(|monitor| Rectangle {
        x: monitor.x.into(),
        y: monitor.y.into(),
        width: monitor.width.into(),
        height: monitor.height.into(),
    });
    let (x_middle, y_middle) = now.middle();
    let on = monitors
        .clone()
        .find(|monitor| monitor.has(x_middle, y_middle));
    if let Some(large) = on.and_then(|monitor| enlarged(now, monitor)) {
        let to = ConfigureWindowAux::new()
            .x(large.x)
            .y(large.y)
            .width(large.width)
            .height(large.height);
        x.configure_window(window, &to)?.check()?;
    }
    Ok(())
}

impl Rectangle {
    fn middle(self) -> (i32, i32) {
        let half = |length: u32| (length / 2).cast_signed();
        (self.x + half(self.width), self.y + half(self.height))
    }

    fn has(self, x: i32, y: i32) -> bool {
        let within = |at: i32, from: i32, length: u32| {
            at.checked_sub(from)
                .is_some_and(|at| (0..length.cast_signed()).contains(&at))
        };
        within(x, self.x, self.width) && within(y, self.y, self.height)
    }
}

/// Returns the visible window of the process. It searches the window manager's list, or, without a window
/// manager, the root's children.
fn find(x: &RustConnection, root: Window, process: u32) -> anyhow::Result<Option<Window>> {
    let atom = |name: &str| anyhow::Ok(x.intern_atom(false, name.as_bytes())?.reply()?.atom);
    let numbers = |window, name: &str, of| {
        let property = x.get_property(false, window, atom(name)?, of, 0, 1024)?;
        let property = property.reply()?;
        anyhow::Ok(property.value32().map(Iterator::collect::<Vec<u32>>))
    };
    let managed = numbers(root, "_NET_CLIENT_LIST", AtomEnum::WINDOW)?;
    let all = match managed {
        Some(windows) => windows,
        None => x.query_tree(root)?.reply()?.children,
    };
    let is_shown = |window| {
        let state = x.get_window_attributes(window)?.reply()?.map_state;
        let of = numbers(window, "_NET_WM_PID", AtomEnum::CARDINAL)?;
        anyhow::Ok(state == MapState::VIEWABLE && of.is_some_and(|of| of == [process]))
    };
    // A window that has closed since it was listed gives an error, and is not QEMU's.
    Ok(all
        .into_iter()
        .find(|&window| is_shown(window).unwrap_or(false)))
}

/// Returns the largest suitable rectangle in the monitor's middle. Returns `None` if the window is already as
/// large as the rectangle, or has a size that QEMU does not give it: then the user or the window manager
/// chose the size.
fn enlarged(window: Rectangle, monitor: Rectangle) -> Option<Rectangle> {
    let (width, height) = FRAME;
    // The height above the frame: GTK's menus.
    let above = window.height.checked_sub(window.width / width * height)?;
    if !window.width.is_multiple_of(width) || above > window.height / 8 {
        return None;
    }
    let fits = |of: u32, frame: u32| of * FIFTHS / 5 / frame;
    let times = fits(monitor.width, width).min(fits(monitor.height, height));
    let (width, height) = (times * width, times * height + above);
    let (x, y) = monitor.middle();
    (width > window.width).then(|| Rectangle {
        x: x - (width / 2).cast_signed(),
        y: y - (height / 2).cast_signed(),
        width,
        height,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(x: i32, y: i32, width: u32, height: u32) -> Rectangle {
        Rectangle {
            x,
            y,
            width,
            height,
        }
    }

    #[test]
    fn a_window_is_enlarged_to_the_largest_whole_multiple_that_leaves_room() {
        let gtk = area(10, 10, 640, 505);
        for (monitor, large) in [
            (area(0, 0, 1920, 1080), Some(area(480, 168, 960, 745))),
            // The second of two monitors, once upright and once to the left.
            (area(1920, 0, 1080, 1920), None),
            (
                area(-2560, 0, 2560, 1440),
                Some(area(-1920, 228, 1280, 985)),
            ),
            (area(0, 0, 3840, 2160), Some(area(800, 228, 2240, 1705))),
            (area(0, 0, 1366, 768), None),
            (area(0, 0, 640, 480), None),
        ] {
            assert_eq!(enlarged(gtk, monitor), large, "{monitor:?}");
        }
        let sdl = area(0, 0, 640, 480);
        let full_hd = area(0, 0, 1920, 1080);
        assert_eq!(enlarged(sdl, full_hd), Some(area(480, 180, 960, 720)));
        // On a desktop of scale 2, GTK's window is twice as large, including its menus.
        let scaled = area(0, 0, 1280, 1010);
        assert_eq!(enlarged(scaled, full_hd), None);
        let at_4k = enlarged(scaled, area(0, 0, 3840, 2160));
        assert_eq!(at_4k, Some(area(800, 215, 2240, 1730)));
        // A tiled, a maximised and a resized window.
        for chosen in [
            area(0, 0, 960, 1080),
            area(0, 0, 1920, 1080),
            area(0, 0, 700, 525),
        ] {
            assert_eq!(enlarged(chosen, area(0, 0, 3840, 2160)), None, "{chosen:?}");
        }
    }

    #[test]
    fn a_point_is_on_at_most_one_monitor() {
        let (left, right) = (area(0, 0, 1920, 1080), area(1920, 0, 1280, 1024));
        for (x, y, of) in [
            (0, 0, [true, false]),
            (1919, 1079, [true, false]),
            (1920, 0, [false, true]),
            (1920, 1050, [false, false]),
            (-1, 5, [false, false]),
            (i32::MIN, 5, [false, false]),
        ] {
            assert_eq!([left, right].map(|area| area.has(x, y)), of, "{x} {y}");
        }
    }
}
