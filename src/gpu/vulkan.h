// SPDX-License-Identifier: Apache-2.0
// Vulkan-Hpp as this room uses it: unique handles, results checked by exceptions in every build type.
#pragma once
#include <vulkan/vulkan.hpp>
