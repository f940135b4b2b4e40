// One region of living skin, drawn into the map of the shared frame: 002 §V.iii's edge-blended texture volume.

struct Region {
    // First pixel of the volume, and its pixels across and down.
    origin: vec2f,
    size: vec2f,
    // The area: its middle; from there to its edges, over their squared lengths; those lengths.
    centre: vec2f,
    across: vec2f,
    down: vec2f,
    halves: vec2f,
    // Pixels of the map.
    frame: vec2f,
    // Pixels from the area's edge to where it shows wholly.
    ramp: f32,
    // Between the layers, as the device counts them: 0..1 through all of them.
    layer: f32,
    state: f32,
    gain: f32,
    // 1: colours, multiplied by how much they show; 0: logarithms of ratios.
    own: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> region: Region;
@group(0) @binding(1) var volume: texture_3d<f32>;
@group(0) @binding(2) var between: sampler;

@vertex
fn region_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    let place = (region.origin + corner * region.size) / region.frame;
    return vec4f(place.x * 2.0 - 1.0, 1.0 - place.y * 2.0, 0.0, 1.0);
}

@fragment
fn region_fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    // The frame counts pixel centres as whole numbers, the device their corners.
    let from_centre = position.xy - 0.5 - region.centre;
    let inside = vec2f(dot(from_centre, region.across), dot(from_centre, region.down));
    let depth = (1.0 - abs(inside)) * region.halves;
    let alpha = clamp(min(depth.x, depth.y) / region.ramp, 0.0, 1.0);
    let texel = textureSampleLevel(volume, between, vec3f((position.xy - region.origin) / region.size, region.layer), 0.0);
    if region.own > 0.5 {
        return alpha * texel;
    }
    return alpha * vec4f(region.gain * texel.r, 0.0, 0.0, region.state);
}
