//! The requirements on GPUs.

use super::GpuError;

/// The number of storage buffers that a shader stage needs; the fragments of the lighting pass need
/// the most.
const STORAGE_BUFFERS: u32 = 7;

/// The least size of a buffer binding, bytes.
const BINDING: u64 = 64 << 20;

/// # Errors
/// If the GPU of this name lacks something; the error names it in wgpu's terms.
pub(super) fn check(
    name: &str,
    flags: wgpu::DownlevelFlags,
    limits: &wgpu::Limits,
) -> Result<(), GpuError> {
    use wgpu::DownlevelFlags as Able;
    let abilities = [
        (Able::VERTEX_STORAGE, "vertex shaders read storage buffers"),
        (Able::FRAGMENT_STORAGE, "fragment shaders read them"),
        (
            Able::COMPUTE_SHADERS,
            "compute shaders decide what is drawn",
        ),
        (Able::INDIRECT_EXECUTION, "that is drawn indirectly"),
    ];
    if let Some((lacking, why)) = abilities.iter().find(|(able, _)| !flags.contains(*able)) {
        let what = format!("it lacks {lacking:?}, which is needed: {why}");
        return Err(too_small(name, what));
    }
    let least = [
        (
            "max_storage_buffers_per_shader_stage",
            limits.max_storage_buffers_per_shader_stage.into(),
            STORAGE_BUFFERS.into(),
            "",
        ),
        (
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
            BINDING,
            " bytes",
        ),
    ];
    for (field, value, least, unit) in least {
        if value < least {
            let what = format!("its {field} is {value}{unit}, at least {least}{unit} are needed");
            return Err(too_small(name, what));
        }
    }
    Ok(())
}

/// # Errors
/// If the GPU of this name cannot draw a picture of this size, pixels.
pub(super) fn check_size(
    name: &str,
    [width, height]: [u32; 2],
    limits: &wgpu::Limits,
) -> Result<(), GpuError> {
    let largest = limits.max_texture_dimension_2d;
    if width.max(height) <= largest {
        return Ok(());
    }
    Err(too_small(
        name,
        format!(
            "its max_texture_dimension_2d is {largest}, a picture of {width} x {height} \
             (camera.width_px, camera.height_px) needs {}",
            width.max(height)
        ),
    ))
}

fn too_small(name: &str, what: String) -> GpuError {
    GpuError::TooSmall {
        name: name.to_owned(),
        what,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(flags: wgpu::DownlevelFlags, limits: &wgpu::Limits) -> String {
        let refused = check("Toy", flags, limits).expect_err("too small");
        assert!(matches!(refused, GpuError::TooSmall { .. }), "{refused:?}");
        refused.to_string()
    }

    #[test]
    fn what_is_too_small_is_told_with_a_way_out() {
        let all = wgpu::DownlevelFlags::all();
        let enough = wgpu::Limits::default();
        assert_eq!(check("Toy", all, &enough), Ok(()));
        let few = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 4,
            ..enough.clone()
        };
        let short = wgpu::Limits {
            max_storage_buffer_binding_size: 1 << 20,
            ..enough.clone()
        };
        let blind = all - wgpu::DownlevelFlags::COMPUTE_SHADERS;
        for (words, what) in [
            (
                words(all, &few),
                "its max_storage_buffers_per_shader_stage is 4, at least 7 are needed",
            ),
            (
                words(all, &short),
                "its max_storage_buffer_binding_size is 1048576 bytes, at least 67108864 bytes are \
                 needed",
            ),
            (words(blind, &enough), "COMPUTE_SHADERS"),
        ] {
            assert!(words.contains(what), "{words}");
            for part in ["the GPU Toy is too small", "--backend cpu"] {
                assert!(words.contains(part), "{words}");
            }
        }
    }

    #[test]
    fn pictures_may_be_too_large() {
        let limits = wgpu::Limits {
            max_texture_dimension_2d: 4096,
            ..wgpu::Limits::default()
        };
        assert_eq!(check_size("Toy", [4096, 4096], &limits), Ok(()));
        let refused = check_size("Toy", [720, 4097], &limits).expect_err("too large");
        let words = refused.to_string();
        for part in ["is 4096", "720 x 4097", "camera.height_px", "--backend cpu"] {
            assert!(words.contains(part), "{words}");
        }
    }
}
