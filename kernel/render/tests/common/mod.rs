//! A built-in scene and its renderer.

use render::{RenderMemory, SceneRenderer};
use scene::catalogue::{Entry, MAX_TEXELS};

/// Calls `work` with a scene's entry and its renderer, and returns its result.
pub fn with_renderer<T>(
    name: &str,
    work: impl FnOnce(&Entry<'_>, &mut SceneRenderer<'_>) -> T,
) -> T {
    let entry = Entry::parse(name).unwrap();
    let mut texels = Box::new([0; MAX_TEXELS]);
    let textures = entry.paint(&mut texels);
    let mut memory = in_place::boxed!(RenderMemory);
    work(
        entry,
        &mut SceneRenderer::new(&mut memory, entry.scene(&textures)),
    )
}
