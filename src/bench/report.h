// SPDX-License-Identifier: Apache-2.0
// Results as text and as JSON (bench/README.md describes the schema).
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

/// The ratio of new to old times per case and pass, with the noise of both; larger changes are marked. Throws
/// InputError if `old_results` is not a results file.
std::string compare_text(const Json& old_results, const Json& new_results);

/// printf into a string. ewa-bench links no formatting library.
[[gnu::format(printf, 1, 2)]] std::string text_of(const char* format, ...);

/// "850", "12.3 k", "4.56 M", "7.89 G".
std::string scaled(double value);

}  // namespace ewa::bench
