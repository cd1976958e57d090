// The buffers of the kernel that rounds to half precision.

@group(0) @binding(0) var<storage, read> values: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> halves: array<vec2u>;
