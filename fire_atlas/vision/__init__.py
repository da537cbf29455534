"""Image measurements that are not specific to fire: optical flow, warping, loop quality."""
