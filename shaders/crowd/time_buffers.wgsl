// The buffers that the kernel of positions reads, and those into which it writes the positions.

@group(0) @binding(0) var<storage, read> entries: array<CrowdEntry>;
@group(0) @binding(1) var<storage, read> clips: array<CrowdClip>;
@group(0) @binding(2) var<storage, read> time_bases: array<CrowdBase>;
@group(0) @binding(3) var<storage, read> spans: array<CrowdSpan>;
@group(0) @binding(4) var<storage, read_write> positions: array<CrowdPosition>;
