// How solid figures and ghosts look.

/** The options of a material. Where a ghost is at the place of a solid figure, the solid one is seen. */
export const look = (ghost) =>
  ghost ? { transparent: true, opacity: 0.45, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 } : {};
