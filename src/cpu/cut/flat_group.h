#pragma once

#include <span>

#include "cpu/cut/receiver_groups.h"
#include "kernels/group_lookup.h"

namespace lightcuts {

/// The parallelogram that holds the pixels of a group that lies in one plane, along the tile's rows and columns; its
/// `reach` is infinite where it does not.
FlatReceivers flat_receivers(std::span<const SurfacePacket> packets, const PixelGroup& group);

/// True where a VPL lights no receiver of a flat group for certain. @param flat_normals  shading normals are those of the plane
bool lights_none(const FlatReceivers& receivers, const Vpl& vpl, bool flat_normals);

}  // namespace lightcuts
