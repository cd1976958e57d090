// The links that the kernels over a skeleton read, and the matrices that they change.

@group(0) @binding(0) var<storage, read> links: array<CrowdLink>;
@group(0) @binding(1) var<storage, read_write> matrices: array<vec4f>;
