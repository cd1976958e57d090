// How many invocations a workgroup of the kernels over a crowd has.

const CROWD_WORKGROUP: u32 = 64;
