#include "cal_report.hpp"
namespace cal
{
void report_write(const std::string &, const Result &)
{
}
} // namespace cal
