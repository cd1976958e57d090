// The appearance of solid figures and ghosts.

/** The options of a material. `polygonOffset` keeps the solid figure in front of a ghost at the same position. */
export const look = (ghost) =>
  ghost ? { transparent: true, opacity: 0.45, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 } : {};
