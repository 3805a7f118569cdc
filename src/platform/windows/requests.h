// SPDX-License-Identifier: Apache-2.0
// Requests to end between processes of ewa, for those without a common console.
#pragma once
#include "platform/windows/windows.h"

namespace ewa::platform {

/// The name of the event by which another process asks this one to end.
std::wstring request_name(DWORD process);

/// Asks the process to end. False if it takes no such requests.
bool request_end(DWORD process);

}  // namespace ewa::platform
