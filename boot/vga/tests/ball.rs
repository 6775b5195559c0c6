//! The ball on the emulated VGA: driver and renderer as they run on the bare machine.

use modex::registers::{CRTC, MAP_MASK, MODE_X, SEQUENCER, START_ADDRESS_HIGH};
use modex::{Counted, HEIGHT, ModeX, PAGE_BYTES, PlanarBuffer, Purpose, WIDTH};
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::Pose;
use vga::Vga;

#[test]
fn every_frame_equals_the_frame_drawn_in_ram_without_a_fault() {
    let mut texels = Box::new([0; scene::TEXELS]);
    let textures = [scene::paint_ball(&mut texels)];
    let scene = scene::ball(&textures);
    let mut memory = in_place::boxed!(RenderMemory);
    let mut renderer = SceneRenderer::new(&mut memory, scene);
    let mut card = ModeX::set(Counted::new(Vga::new()), scene.palette).unwrap();
    let mut columns = 0;
    for frame in [0, 1000, u32::MAX, 360, 0] {
        let mut canvas = card.begin(scene.background);
        let stats = renderer
            .draw(&Pose::at_tick(frame), RenderOptions::default(), &mut canvas)
            .stats;
        columns += u64::from(stats.columns);
        card.flip();
        card.settle();
        let mut page = Box::new(PlanarBuffer::new());
        page.clear(scene.background);
        renderer.draw(&Pose::at_tick(frame), RenderOptions::default(), &mut *page);
        let start = card.shown_page() * PAGE_BYTES;
        let vga = card.bus().inner();
        for (plane, bytes) in page.planes.iter().enumerate() {
            for (i, &byte) in bytes.iter().enumerate() {
                assert_eq!(
                    vga.peek(plane, (start + i) as u16),
                    byte,
                    "frame {frame}, plane {plane}, byte {i}"
                );
            }
        }
        let shown = vga.scan_out().unwrap();
        assert_eq!((shown.width, shown.height), (2 * WIDTH, 2 * HEIGHT));
        for (i, &dot) in shown.dots.iter().enumerate() {
            let colour = page.pixel(i % 640 / 2, i / 640 / 2);
            assert_eq!(
                dot,
                scene.palette[usize::from(colour)],
                "frame {frame}, dot {i}"
            );
        }
    }
    let mut set = MODE_X;
    set.crtc[usize::from(START_ADDRESS_HIGH)] = 0x96;
    set.sequencer[usize::from(MAP_MASK)] = card.registers().sequencer[2];
    assert_eq!(card.registers(), set);
    // The emulated VGA's counts equal those of the counting bus.
    let counts = *card.bus().counts();
    let vga = card.bus().inner();
    assert_eq!(
        vga.port_writes(Purpose::Draw, SEQUENCER, Some(MAP_MASK)),
        columns
    );
    assert_eq!(vga.all_port_writes(Purpose::Draw), counts.draw.ports);
    assert_eq!(vga.bytes_stored(Purpose::Draw), counts.draw.bytes);
    assert_eq!(vga.bytes_stored(Purpose::Erase), counts.erase.bytes);
    assert_eq!(
        vga.port_writes(Purpose::Flip, CRTC, Some(START_ADDRESS_HIGH)),
        5
    );
}
