// Living skin on the scan; stands behind shade.wgsl, whose light it shares.

struct Skin {
    // 1: the map holds colours, squared, and their share; 0: logarithms of ratios.
    own: f32,
    padding_a: f32,
    padding_b: f32,
    padding_c: f32,
}

@group(2) @binding(0) var skin_map: texture_2d<f32>;
@group(2) @binding(1) var skin_sampler: sampler;
@group(2) @binding(2) var<uniform> skin: Skin;

struct SkinVertex {
    @location(0) uv: vec2f,
    @location(1) colour: vec4f,
    @location(2) position: vec3f,
    @location(3) normal: vec3f,
    // Place in the map, and how far the vertex is of the face.
    @location(4) chart: vec3f,
}

fn bare_vertex(in: SkinVertex) -> Vertex {
    return Vertex(in.uv, in.colour, in.position, in.normal);
}

// What the map says: regions that overlap and are shown together give their mean, not their sum.
fn shown(chart: vec3f) -> vec4f {
    let sum = textureSampleLevel(skin_map, skin_sampler, chart.xy, 0.0);
    return sum * (chart.z / max(sum.a, 1.0));
}

// A surface's own colour with the skin's change, both squared.
fn changed(squared: vec3f, chart: vec3f) -> vec3f {
    let seen = shown(chart);
    let ratio = squared * exp(seen.r * (2.0 / 2.2));
    return select(ratio, squared * (1.0 - seen.a) + seen.rgb, skin.own > 0.5);
}

// The same, both linear.
fn changed_linear(colour: vec3f, chart: vec3f) -> vec3f {
    let seen = shown(chart);
    let own = to_linear(sqrt(seen.rgb / max(seen.a, 1e-6)));
    return select(colour * exp(seen.r), mix(colour, own, seen.a), skin.own > 0.5);
}

struct SkinTextured {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) light: vec4f,
    @location(2) chart: vec3f,
}

@vertex
fn skin_textured_vertex(in: SkinVertex) -> SkinTextured {
    let light = light_at(bare_vertex(in));
    let position = frame.clip_from_model * vec4f(in.position, 1.0);
    let shone = vec4f(exposure(light.diffuse * material.base.rgb), light.shine);
    return SkinTextured(position, in.uv, shone, in.chart);
}

@fragment
fn skin_textured_fragment(in: SkinTextured, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let scan = textureSample(scan_texture, scan_sampler, in.uv).rgb;
    let seen = changed(scan * scan, in.chart) * in.light.rgb + in.light.w;
    return vec4f(sqrt(seen) * shade(front), 1.0);
}

struct SkinPlain {
    @builtin(position) position: vec4f,
    // sRGB.
    @location(0) colour: vec3f,
    @location(1) light: vec4f,
    @location(2) chart: vec3f,
}

@vertex
fn skin_plain_vertex(in: SkinVertex) -> SkinPlain {
    let light = light_at(bare_vertex(in));
    let position = frame.clip_from_model * vec4f(in.position, 1.0);
    return SkinPlain(position, to_srgb(paint(in.colour.rgb)), vec4f(light.diffuse, light.shine), in.chart);
}

@fragment
fn skin_plain_fragment(in: SkinPlain, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let seen = changed_linear(to_linear(in.colour), in.chart) * in.light.rgb + in.light.w;
    return vec4f(to_srgb(seen) * shade(front) + dither(in.position.xy), 1.0);
}

@vertex
fn skin_unlit_textured_vertex(in: SkinVertex) -> SkinTextured {
    return SkinTextured(frame.clip_from_model * vec4f(in.position, 1.0), in.uv, vec4f(1.0), in.chart);
}

@fragment
fn skin_unlit_textured_fragment(in: SkinTextured) -> @location(0) vec4f {
    let scan = textureSample(scan_texture, scan_sampler, in.uv).rgb;
    return vec4f(sqrt(changed(scan * scan, in.chart)) * material.encoded.rgb, 1.0);
}

@vertex
fn skin_unlit_plain_vertex(in: SkinVertex) -> SkinPlain {
    let position = frame.clip_from_model * vec4f(in.position, 1.0);
    return SkinPlain(position, to_srgb(paint(in.colour.rgb)), vec4f(1.0), in.chart);
}

@fragment
fn skin_unlit_plain_fragment(in: SkinPlain) -> @location(0) vec4f {
    return vec4f(to_srgb(changed_linear(to_linear(in.colour), in.chart)), 1.0);
}
