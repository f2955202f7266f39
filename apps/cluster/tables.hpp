/// How documents of the desk look as lines: one per thing, columns under their names. Whatever a controller sends, a line
/// stays one printable line.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lichthof::apps {

using Lines = std::vector<std::string>;

Lines node_lines(const nlohmann::json& nodes);
Lines actor_lines(const nlohmann::json& actors);
Lines job_lines(const nlohmann::json& jobs);
/// Everything about one job, a line per field.
Lines job_detail(const nlohmann::json& job);
Lines method_lines(const nlohmann::json& methods);

// One field of a document, whatever stands there.
std::string text_at(const nlohmann::json& document, const char* key);
double number_at(const nlohmann::json& document, const char* key);

/// "1.2M", three digits.
std::string short_number(double value);
/// "1.2 GB".
std::string bytes_text(double bytes);
/// "[####    ]"
std::string bar(double share, std::size_t width);

}  // namespace lichthof::apps
