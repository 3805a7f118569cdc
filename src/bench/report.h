// SPDX-License-Identifier: Apache-2.0
// Results as text for a terminal, and as JSON (bench/README.md has the schema).
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/result.h"

namespace ewa::bench {

using Json = nlohmann::ordered_json;

Json to_json(const Result& result);

std::string header_text(const Result& result);
std::string case_text(const CaseResult& result);
std::string scaling_text(const std::vector<Scaling>& scaling);

/// Per case and pass, new over old, with the noise of both; what moved by more than that is marked. Throws
/// InputError where `old_results` is not such a file.
std::string compare_text(const Json& old_results, const Json& new_results);

}  // namespace ewa::bench
