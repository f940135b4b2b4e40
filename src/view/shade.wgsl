// The model and what stands behind it. Light is computed linearly; the target holds sRGB.

struct Frame {
    clip_from_model: mat4x4f,
    view_from_model: mat4x4f,
    normal_from_model: mat4x4f,
    // In camera coordinates: a point (w = 1) or a direction (w = 0).
    eye: vec4f,
    // Ambient, key, fill, rim.
    lights: vec4f,
    background_top: vec4f,
    background_bottom: vec4f,
    // Replaces the scan's colours by the weight in w.
    clay: vec4f,
    specular: f32,
    // -1 where the model matrix mirrors, and front faces turn into back faces; 1 elsewhere.
    facing: f32,
    height: f32,
    padding: f32,
}

struct Material {
    base: vec4f,
    textured: f32,
    coloured: f32,
    padding: vec2f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var scan_texture: texture_2d<f32>;
@group(1) @binding(2) var scan_sampler: sampler;

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) colour: vec3f,
    @location(2) normal: vec3f,
    @location(3) view: vec3f,
}

@vertex
fn model_vertex(
    @location(0) uv: vec2f,
    @location(1) colour: vec4f,
    @location(2) position: vec3f,
    @location(3) normal: vec3f,
) -> Varying {
    var out: Varying;
    out.position = frame.clip_from_model * vec4f(position, 1.0);
    out.uv = uv;
    out.colour = colour.rgb;
    out.normal = (frame.normal_from_model * vec4f(normal, 0.0)).xyz;
    out.view = (frame.view_from_model * vec4f(position, 1.0)).xyz;
    return out;
}

fn to_linear(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn to_srgb(l: vec3f) -> vec3f {
    let c = clamp(l, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
}

// At most half an 8-bit step either way, fixed to the pixel (Jimenez, "Next generation post processing", 2014).
fn dither(pixel: vec2f) -> f32 {
    return (fract(52.9829189 * fract(dot(pixel, vec2f(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}

// The scan's own colour, sRGB, without the material's factor.
fn scan_colour(in: Varying) -> vec3f {
    if material.textured > 0.5 {
        return textureSample(scan_texture, scan_sampler, in.uv).rgb;
    }
    if material.coloured > 0.5 {
        return in.colour;
    }
    return vec3f(1.0);
}

@fragment
fn unlit_fragment(in: Varying) -> @location(0) vec4f {
    var colour = scan_colour(in);
    // A factor of one leaves the texture's bytes as they are.
    if any(material.base.rgb != vec3f(1.0)) {
        colour = to_srgb(to_linear(colour) * material.base.rgb);
    }
    return vec4f(colour, 1.0);
}

@fragment
fn lit_fragment(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let outside = select(-1.0, 1.0, front) * frame.facing;
    let to_eye = normalize(frame.eye.xyz - in.view * frame.eye.w);
    let normal = normalize(in.normal) * outside;

    // Camera coordinates: x right, y up, z towards the viewer.
    let key_from = normalize(vec3f(-0.55, 0.62, 0.72));
    let fill_from = normalize(vec3f(0.85, -0.10, 0.55));
    let rim_from = normalize(vec3f(0.45, 0.60, -0.65));

    // The key light wraps a little around the shape, as from a large source.
    let key = max((dot(normal, key_from) + 0.25) / 1.25, 0.0);
    let fill = max(dot(normal, fill_from), 0.0);
    let up = 0.5 + 0.5 * normal.y;
    let grazing = 1.0 - clamp(dot(normal, to_eye), 0.0, 1.0);
    let rim = grazing * grazing * grazing * max(dot(normal, rim_from) + 0.35, 0.0);
    let light = frame.lights.x * mix(vec3f(0.84, 0.82, 0.80), vec3f(1.04, 1.05, 1.08), up)
        + frame.lights.y * key * vec3f(1.03, 1.0, 0.95)
        + frame.lights.z * fill * vec3f(0.92, 0.97, 1.06)
        + frame.lights.w * rim * vec3f(0.95, 1.0, 1.08);

    let half_way = normalize(key_from + to_eye);
    let shine = pow(max(dot(normal, half_way), 0.0), 22.0) * frame.specular;

    let scan = to_linear(scan_colour(in)) * material.base.rgb;
    let albedo = mix(scan, frame.clay.rgb, frame.clay.w);
    // The inside of an open shell lies in its own shadow.
    let colour = select(albedo * light * 0.32, albedo * light + shine, outside > 0.0);
    return vec4f(to_srgb(colour) + dither(in.position.xy), 1.0);
}

@vertex
fn background_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    // One triangle around the whole picture, at the far end of the depth range.
    let corner = vec2f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return vec4f(corner, 1.0, 1.0);
}

@fragment
fn background_fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let colour = mix(frame.background_top, frame.background_bottom, position.y / frame.height);
    return vec4f(colour.rgb + dither(position.xy), colour.a);
}
