// The model and what stands behind it.
//
// A scan's triangles are a few pixels wide and its lights are soft, so light is computed at the vertices, but for wet
// surfaces; on a CPU this halves the time of a picture. Light adds up linearly. Fragments decode the scan's sRGB by
// squaring and encode by the square root, between which a factor of one is exact; `exposure` bends the light so that
// the product is that of the usual exponent 2.2.

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
    // Replaces the scan's colours by the weight in w, linear.
    clay: vec4f,
    specular: f32,
    // -1 where the model matrix mirrors, and front faces turn into back faces; 1 elsewhere.
    facing: f32,
    height: f32,
    padding: f32,
}

struct Material {
    base: vec4f,
    // The same factor for colours in sRGB; one leaves a texture's bytes as they are.
    encoded: vec4f,
    // Whether the vertex colours are used: 1 or 0.
    coloured: f32,
    // How wet it shines, 0..=1.
    gloss: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var scan_texture: texture_2d<f32>;
@group(1) @binding(2) var scan_sampler: sampler;

fn to_linear(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

fn to_srgb(l: vec3f) -> vec3f {
    let c = clamp(l, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
}

fn exposure(light: vec3f) -> vec3f {
    return pow(light, vec3f(2.0 / 2.2));
}

// At most half an 8-bit step either way, fixed to the pixel (Jimenez, "Next generation post processing", 2014).
fn dither(pixel: vec2f) -> f32 {
    return (fract(52.9829189 * fract(dot(pixel, vec2f(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}

// The surface's own colour where it has no texture, linear.
fn paint(colour: vec3f) -> vec3f {
    let scan = material.base.rgb * mix(vec3f(1.0), to_linear(colour), material.coloured);
    return mix(scan, frame.clay.rgb, frame.clay.w);
}

// How broad the key light's reflection is on skin, and on the wettest surface: on an eye a tenth of its iris.
const SKIN_EXPONENT: f32 = 22.0;
const WET_EXPONENT: f32 = 1000.0;
// How strong it is there; skin's is the frame's. Above one, so that its middle is white.
const WET_STRENGTH: f32 = 1.6;
// The fill light is seen only in what is wetter than this, and faintly.
const MIRROR: f32 = 0.7;
const FILL_STRENGTH: f32 = 0.25;

struct Light {
    // Multiplies the surface's colour.
    diffuse: vec3f,
    // Is added to it.
    shine: f32,
}

fn key_direction() -> vec3f {
    return normalize(vec3f(-0.55, 0.62, 0.72));
}

fn fill_direction() -> vec3f {
    return normalize(vec3f(0.85, -0.10, 0.55));
}

fn towards_eye(point: vec3f) -> vec3f {
    return normalize(frame.eye.xyz - point * frame.eye.w);
}

// Light what is seen: the inside of an open shell has its own normal. A vertex on the outline stays outside.
fn seen_normal(outwards: vec3f, to_eye: vec3f) -> vec3f {
    return select(-outwards, outwards, dot(outwards, to_eye) > -0.25);
}

// A light's reflection; the exponent says how small it is.
fn reflection(normal: vec3f, to_eye: vec3f, from_light: vec3f, exponent: f32) -> f32 {
    return pow(max(dot(normal, normalize(from_light + to_eye)), 0.0), exponent);
}

// The light on a point in camera coordinates: x right, y up, z towards the viewer.
fn light(point: vec3f, outwards: vec3f) -> Light {
    let to_eye = towards_eye(point);
    let normal = seen_normal(outwards, to_eye);

    let key_from = key_direction();
    let fill_from = fill_direction();
    let rim_from = normalize(vec3f(0.45, 0.60, -0.65));

    // The key light wraps a little around the shape, as from a large source.
    let key = max((dot(normal, key_from) + 0.25) / 1.25, 0.0);
    let fill = max(dot(normal, fill_from), 0.0);
    let up = 0.5 + 0.5 * normal.y;
    let grazing = 1.0 - clamp(dot(normal, to_eye), 0.0, 1.0);
    let rim = grazing * grazing * grazing * max(dot(normal, rim_from) + 0.35, 0.0);
    let shine = reflection(normal, to_eye, key_from, SKIN_EXPONENT);

    var out: Light;
    out.diffuse = frame.lights.x * mix(vec3f(0.84, 0.82, 0.80), vec3f(1.04, 1.05, 1.08), up)
        + frame.lights.y * key * vec3f(1.03, 1.0, 0.95)
        + frame.lights.z * fill * vec3f(0.92, 0.97, 1.06)
        + frame.lights.w * rim * vec3f(0.95, 1.0, 1.08);
    out.shine = shine * frame.specular;
    return out;
}

struct Vertex {
    @location(0) uv: vec2f,
    @location(1) colour: vec4f,
    @location(2) position: vec3f,
    @location(3) normal: vec3f,
}

fn light_at(in: Vertex) -> Light {
    let normal = normalize((frame.normal_from_model * vec4f(in.normal, 0.0)).xyz);
    return light((frame.view_from_model * vec4f(in.position, 1.0)).xyz, normal);
}

// The inside of an open shell lies in its own shadow.
fn shade(front: bool) -> f32 {
    return select(0.55, 1.0, front == (frame.facing > 0.0));
}

struct Textured {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) light: vec4f,
}

@vertex
fn textured_vertex(in: Vertex) -> Textured {
    let light = light_at(in);
    var out: Textured;
    out.position = frame.clip_from_model * vec4f(in.position, 1.0);
    out.uv = in.uv;
    out.light = vec4f(exposure(light.diffuse * material.base.rgb), light.shine);
    return out;
}

@fragment
fn textured_fragment(in: Textured, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let scan = textureSample(scan_texture, scan_sampler, in.uv).rgb;
    return vec4f(sqrt(scan * scan * in.light.rgb + in.light.w) * shade(front), 1.0);
}

struct Plain {
    @builtin(position) position: vec4f,
    @location(0) colour: vec3f,
}

@vertex
fn plain_vertex(in: Vertex) -> Plain {
    let light = light_at(in);
    var out: Plain;
    out.position = frame.clip_from_model * vec4f(in.position, 1.0);
    out.colour = to_srgb(paint(in.colour.rgb) * light.diffuse + light.shine);
    return out;
}

@fragment
fn plain_fragment(in: Plain, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return vec4f(in.colour * shade(front) + dither(in.position.xy), 1.0);
}

// Wet surfaces are small, their reflections smaller than their triangles: they alone are lit at every pixel.
struct Glossy {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
    @location(1) colour: vec3f,
    // In camera coordinates.
    @location(2) point: vec3f,
    @location(3) normal: vec3f,
}

@vertex
fn glossy_vertex(in: Vertex) -> Glossy {
    var out: Glossy;
    out.position = frame.clip_from_model * vec4f(in.position, 1.0);
    out.uv = in.uv;
    out.colour = exposure(paint(in.colour.rgb));
    out.point = (frame.view_from_model * vec4f(in.position, 1.0)).xyz;
    out.normal = normalize((frame.normal_from_model * vec4f(in.normal, 0.0)).xyz);
    return out;
}

// What is reflected of the lights: of skin's shine at gloss 0, a glint at 1.
fn glints(point: vec3f, outwards: vec3f) -> f32 {
    let to_eye = towards_eye(point);
    let normal = seen_normal(outwards, to_eye);
    let gloss = material.gloss;
    let sharpest = SKIN_EXPONENT * pow(WET_EXPONENT / SKIN_EXPONENT, gloss);
    // A reflection smaller than a pixel would twinkle as the head moves: it is widened to what a pixel covers, and
    // weakened by as much.
    let across = dpdx(outwards);
    let down = dpdy(outwards);
    let exponent = 1.0 / (1.0 / sharpest + 0.125 * (dot(across, across) + dot(down, down)));
    let key = mix(frame.specular, WET_STRENGTH, gloss * gloss)
        * reflection(normal, to_eye, key_direction(), exponent);
    let fill = FILL_STRENGTH * smoothstep(MIRROR, 1.0, gloss)
        * reflection(normal, to_eye, fill_direction(), exponent);
    return (key + fill) * exponent / sharpest;
}

// With or without a texture: a surface without one samples white.
@fragment
fn glossy_fragment(in: Glossy, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let outwards = normalize(in.normal);
    let scan = textureSample(scan_texture, scan_sampler, in.uv).rgb;
    let colour = in.colour * scan * scan * exposure(light(in.point, outwards).diffuse);
    let seen = sqrt(colour + glints(in.point, outwards)) * shade(front);
    return vec4f(seen + dither(in.position.xy), 1.0);
}

struct UnlitTextured {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn unlit_textured_vertex(in: Vertex) -> UnlitTextured {
    var out: UnlitTextured;
    out.position = frame.clip_from_model * vec4f(in.position, 1.0);
    out.uv = in.uv;
    return out;
}

@fragment
fn unlit_textured_fragment(in: UnlitTextured) -> @location(0) vec4f {
    let scan = textureSample(scan_texture, scan_sampler, in.uv).rgb;
    return vec4f(scan * material.encoded.rgb, 1.0);
}

@vertex
fn unlit_plain_vertex(in: Vertex) -> Plain {
    var out: Plain;
    out.position = frame.clip_from_model * vec4f(in.position, 1.0);
    out.colour = to_srgb(paint(in.colour.rgb));
    return out;
}

@fragment
fn unlit_plain_fragment(in: Plain) -> @location(0) vec4f {
    return vec4f(in.colour, 1.0);
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
    return vec4f(colour.rgb + dither(position.xy), 1.0);
}
