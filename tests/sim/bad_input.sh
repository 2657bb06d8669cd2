#!/bin/sh
# Bad inputs of host_sim, one after the other: each must be reported with file and reason, must not
# harm what is beside it, and must not crash.
#
#     bad_input.sh HOST_SIM FRAMES_DIR
#
# FRAMES_DIR: any frames directory with at least three good frames; its first three are used, with
# its rig, written anew here. Prints TAP; exit status 1 when a case fails.
set -u
LC_ALL=C
export LC_ALL

if [ $# -ne 2 ] || [ ! -x "$1" ] || [ ! -d "$2" ]; then
    echo "usage: $0 HOST_SIM FRAMES_DIR" >&2
    exit 2
fi
host_sim=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
good=$(cd "$2" && pwd)
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
cd "$work" || exit 2

# A report of a sanitizer must not pass for the program's own status 1.
ASAN_OPTIONS="${ASAN_OPTIONS:+$ASAN_OPTIONS:}exitcode=99"
UBSAN_OPTIONS="${UBSAN_OPTIONS:+$UBSAN_OPTIONS:}halt_on_error=1:exitcode=99"
export ASAN_OPTIONS UBSAN_OPTIONS

number=0
failed=0

# --- checking ------------------------------------------------------------------------------------

# result NAME REASON: an empty reason is a pass.
result() {
    number=$((number + 1))
    if [ -z "$2" ]; then
        echo "ok $number - $1"
        return
    fi
    failed=$((failed + 1))
    echo "not ok $number - $1"
    echo "# $2"
    sed 's/^/# stderr: /' err | head -n 5
}

# run ARGUMENT...: host_sim with its output in the files out, err and status.
run() {
    timeout 600 "$host_sim" "$@" >out 2>err
    echo $? >status
}

# check NAME STATUS GOOD BAD PATTERN: of the last run: exit status, records of good frames, records
# of lost ones, and what standard error must say (- for nothing at all).
check() {
    reason=
    is_status=$(cat status)
    is_good=$(grep -c '^{"file":.*"hypotheses":\[.*}$' out)
    is_bad=$(grep -c '^{"file":"[^}]*","error":"[^}]*}$' out)
    is_lines=$(wc -l <out)
    if grep -Eq 'Sanitizer|runtime error' err; then
        reason="a sanitizer report"
    elif [ "$is_status" -ne "$2" ]; then
        reason="exit status $is_status, expected $2"
    elif [ "$is_good" -ne "$3" ] || [ "$is_bad" -ne "$4" ]; then
        reason="$is_good good and $is_bad lost records, expected $3 and $4"
    elif [ "$is_lines" -ne $(($3 + $4)) ]; then
        reason="$is_lines lines of output, expected $(($3 + $4))"
    elif [ "$5" = - ]; then
        [ ! -s err ] || reason="standard error is not empty"
    elif ! grep -Eq -- "$5" err; then
        reason="standard error does not say: $5"
    fi
    result "$1" "$reason"
}

# --- making --------------------------------------------------------------------------------------

frame_header() { # first three numbers of a PGM without comments
    head -c 40 "$1" | tr '\n' ' ' | cut -d ' ' -f 2-4
}

# matrix ROWS COLS NUMBERS
matrix() {
    printf '{"type_id":"opencv-matrix","rows":%s,"cols":%s,"dt":"d","data":[%s]}' "$1" "$2" "$3"
}

# data FIELD: the numbers of a matrix of the good directory's rig.
data() {
    tr -d ' \n' <"$good/rig.json" | sed "s/.*\"$1\":{[^}]*\"data\":\[\([^]]*\)\].*/\1/"
}

# rays [SLOT X Y Z]: the pattern's unit vectors; one of them replaced.
rays() {
    data dot_rays | awk -F , -v slot="${1:--1}" -v new="${2:-0},${3:-0},${4:-0}" '{
        for (i = 0; i < 361; i++) {
            ray = i == slot ? new : $(3 * i + 1) "," $(3 * i + 2) "," $(3 * i + 3)
            printf "%s%s", i ? "," : "", ray
        }
    }'
}

# rig FIELD JSON: a good rig with this field replaced, or left out for -.
rig() {
    printf '{'
    comma=
    for field in kind image_width image_height camera_matrix distortion_coefficients \
        projector_origin dot_rays near_mm far_mm extra; do
        value=$(cat "fields/$field")
        [ "$field" != "$1" ] || value=$2
        if [ "$value" != - ]; then
            printf '%s"%s":%s' "$comma" "$field" "$value"
            comma=,
        fi
    done
    printf '}\n'
}

# The directory d as it should be: three frames and a rig.
fresh() {
    rm -rf d
    cp -R base d
}

# --- a good directory ----------------------------------------------------------------------------

mkdir base fields
set -- "$good"/*.pgm
if [ $# -lt 3 ]; then
    echo "$good: fewer than 3 frames" >&2
    exit 2
fi
cp "$1" base/a.pgm && cp "$2" base/b.pgm && cp "$3" base/c.pgm || exit 2
chmod u+w base/*.pgm
# shellcheck disable=SC2046 # three words are wanted
set -- $(frame_header base/a.pgm)
width=$1
height=$2
camera=$(data camera_matrix)
echo - >fields/kind
echo "$width" >fields/image_width
echo "$height" >fields/image_height
matrix 3 3 "$camera" >fields/camera_matrix
matrix 1 5 "$(data distortion_coefficients)" >fields/distortion_coefficients
matrix 3 1 "$(data projector_origin)" >fields/projector_origin
matrix 361 3 "$(rays)" >fields/dot_rays
echo 400 >fields/near_mm
echo 2600.0 >fields/far_mm
echo - >fields/extra
rig none - >base/rig.json

fresh
run --json d
check 'good directory' 0 3 0 -

# --- frames --------------------------------------------------------------------------------------

# frame NAME PATTERN: d/b.pgm was spoilt; the others must go on.
frame() {
    run --json d
    check "frame: $1" 1 2 1 "$2"
    fresh
}

# frame_bytes NAME PATTERN FORMAT: the frame is what printf makes of the format.
frame_bytes() {
    # shellcheck disable=SC2059 # the format is the frame
    printf "$3" >d/b.pgm
    frame "$1" "$2"
}

head -c 1000 base/b.pgm >d/b.pgm
frame 'truncated' 'd/b\.pgm: offset [0-9]+: [0-9]+ bytes of samples, expected [0-9]+.*truncated'
size=$(wc -c <base/b.pgm)
head -c $((size - 1)) base/b.pgm >d/b.pgm
frame 'one byte short' 'd/b\.pgm: offset .*truncated'
printf x >>d/b.pgm
frame 'a byte too many' 'd/b\.pgm: offset .*more than one image'
cat base/c.pgm >>d/b.pgm
frame 'two images' 'd/b\.pgm: offset .*more than one image'
: >d/b.pgm
frame 'empty' 'd/b\.pgm: .*empty, expected a binary PGM'
frame_bytes 'text' 'd/b\.pgm: offset 0: not a PGM, expected a binary PGM' 'not an image\n'
frame_bytes 'JPEG' 'd/b\.pgm: offset 0: not a PGM' '\377\330\377\340\000\020JFIF'
frame_bytes 'P5 and no more' 'd/b\.pgm: offset 0: not a PGM' 'P5'
frame_bytes 'plain PGM' 'd/b\.pgm: offset 0: format P2' 'P2\n2 2\n255\n1 2 3 4\n'
frame_bytes 'colour image' 'd/b\.pgm: offset 0: format P6' 'P6\n1 1\n255\nabc'
frame_bytes 'header ends early' 'd/b\.pgm: offset 6: the file ends, expected height' 'P5\n752'
frame_bytes 'letters for width' "d/b\\.pgm: offset 3: 'w', expected width" 'P5\nwide 4\n255\n'
frame_bytes 'negative width' "d/b\\.pgm: offset 3: '-', expected width" 'P5\n-4 4\n255\n'
frame_bytes 'width 0' 'd/b\.pgm: offset 3: width 0, expected 1 to' 'P5\n0 4\n255\n'
frame_bytes 'height 0' 'd/b\.pgm: offset 5: height 0, expected 1 to' 'P5\n4 0\n255\n'
frame_bytes 'width of 30 digits' 'd/b\.pgm: offset 3: width .*expected 1 to' \
    'P5\n999999999999999999999999999999 4\n255\n'
frame_bytes 'width 2^32 + 4' 'd/b\.pgm: offset 3: width .*expected 1 to' \
    'P5\n4294967300 4\n255\nabcdabcdabcdabcd'
frame_bytes 'huge size' 'd/b\.pgm: offset .*expected 134217728' 'P5\n8192 8192\n65535\nab'
frame_bytes 'maxval 0' 'd/b\.pgm: offset 7: maxval 0, expected 1 to 65535' 'P5\n4 4\n0\nabcd'
frame_bytes 'maxval 65536' 'd/b\.pgm: offset 7: maxval 65536, expected 1 to 65535' \
    'P5\n4 4\n65536\nabcd'
frame_bytes 'nothing behind maxval' 'd/b\.pgm: offset 10: the file ends, expected one white space' \
    'P5\n4 4\n255'
frame_bytes 'endless comment' 'd/b\.pgm: offset .*the file ends, expected width' \
    'P5\n# no line end 4 4 255'
{ printf 'P5\n320 240\n255\n' && head -c 76800 /dev/zero; } >d/b.pgm
frame 'wrong size' "d/b\\.pgm: 320x240 px, expected ${width}x$height"
{ printf 'P5\n%d %d\n255\n' "$height" "$width" && tail -c $((width * height)) base/b.pgm; } >d/b.pgm
frame 'width and height exchanged' "d/b\\.pgm: ${height}x$width px, expected ${width}x$height"
{ printf 'P5\n%d %d\n1023\n' "$width" "$height" && tail -c $((width * height)) base/b.pgm; } >d/b.pgm
frame '16 bits announced, 8 there' 'd/b\.pgm: offset .*2 bytes each.*truncated'
rm d/b.pgm && mkdir d/b.pgm
frame 'a directory' 'd/b\.pgm: a directory, expected a file'
rm d/b.pgm && ln -s nowhere d/b.pgm
frame 'a link to nowhere' 'd/b\.pgm: No such file'
rm d/b.pgm && ln -s b.pgm d/b.pgm
frame 'a link to itself' 'd/b\.pgm: .*symbolic links'
rm d/b.pgm && mkfifo d/b.pgm
frame 'a pipe' 'd/b\.pgm: a device or pipe, expected a file'
rm d/b.pgm && ln -s /dev/zero d/b.pgm
frame 'an endless device' 'd/b\.pgm: a device or pipe, expected a file'
if [ "$(id -u)" -ne 0 ]; then # root may read everything
    chmod 000 d/b.pgm
    frame 'not permitted' 'd/b\.pgm: Permission denied'
fi

{ printf 'P5\n# a comment\n%d # another\n%d\n255\n' "$width" "$height" &&
    tail -c $((width * height)) base/b.pgm; } >d/b.pgm
run --json d
check 'frame: comments in the header are fine' 0 3 0 -
fresh
{ printf 'P5 %d %d 1023 ' "$width" "$height" && head -c $((width * height * 2)) /dev/zero; } >d/b.pgm
run --json d
check 'frame: 16 bits are fine' 0 3 0 -
fresh
cp base/a.pgm d/.hidden.pgm && mkdir d/sub && cp base/a.pgm d/notes.txt
run --json d
check 'frame: other files are ignored' 0 3 0 -
fresh
name=$(printf 'b"\\\t\377\033[2J.pgm')
mv d/b.pgm "d/$name"
run --json d
check 'frame: strange name' 0 3 0 -
reason=
grep -Fq '{"file":"b\"\\\u0009\ufffd\u001b[2J.pgm",' out || reason='name not escaped'
result 'frame: strange name is escaped' "$reason"
: >"d/$name"
run --json d
reason='a control character went to standard error'
[ "$(tr -d -c '\033\011' <err | wc -c)" -ne 0 ] || reason=
result 'frame: strange name does not steer the terminal' "$reason"
fresh

# --- rig -----------------------------------------------------------------------------------------

# rig_case NAME PATTERN: d/rig.json is wrong; nothing can be processed.
rig_case() {
    run --json d
    check "rig: $1" 1 0 0 "$2"
    fresh
}

# field NAME JSON PATTERN: d/rig.json with one field wrong; the pattern follows the file's name.
field() {
    rig "$1" "$2" >d/rig.json
    rig_case "$1 $(echo "$2" | cut -c 1-40)" "d/rig\\.json: $3"
}

rm d/rig.json
rig_case 'missing' 'd: no rig\.json'
: >d/rig.json
rig_case 'empty' 'd/rig\.json: line 1: not JSON'
head -c 300 base/rig.json >d/rig.json
rig_case 'truncated' 'd/rig\.json: line 1.*: not JSON'
echo '%YAML:1.0' >d/rig.json
rig_case 'YAML' 'd/rig\.json: line 1 column 1: not JSON: %YAML'
printf '{\n"image_width":752,\n"near_mm":.Nan}' >d/rig.json
rig_case 'a bare NaN' 'd/rig\.json: line 3 column [0-9]+: not JSON'
echo '[1,2]' >d/rig.json
rig_case 'an array' 'd/rig\.json: an array, expected an object'
{ cat base/rig.json && echo '{}'; } >d/rig.json
rig_case 'two objects' 'd/rig\.json: line 2 column 1: not JSON'
{ printf '{"a":1,\000' && tail -c +2 base/rig.json; } >d/rig.json
rig_case 'a zero byte' 'd/rig\.json: offset 7: a zero byte'
head -c 100000 /dev/zero | tr '\000' '[' >d/rig.json
rig_case 'deep nesting' 'd/rig\.json: line 1 column [0-9]+: not JSON'
{ cat base/rig.json && head -c 5000000 /dev/zero | tr '\000' ' '; } >d/rig.json
rig_case 'too long' 'd/rig\.json: [0-9]+ bytes, expected at most'
rm d/rig.json && mkdir d/rig.json
rig_case 'a directory' 'd/rig\.json: a directory, expected a file'
rm d/rig.json && ln -s nowhere d/rig.json
rig_case 'a link to nowhere' 'd/rig\.json: No such file'

for name in image_width image_height camera_matrix distortion_coefficients projector_origin \
    dot_rays near_mm far_mm; do
    field $name - "$name: missing"
    field $name '"text"' "$name: .*expected"
    field $name null "$name: .*expected"
    field $name '[1,2]' "$name: .*expected"
done

# twice NAME FIELD PATTERN: a good rig with this field at its end once more.
twice() {
    sed "s/}\$/,$2}/" base/rig.json >d/rig.json
    rig_case "$1 a second time" "d/rig\\.json: $3: a second time"
}
twice 'a number' '"near_mm":400' near_mm
twice 'one that need not be there' '"up":[0,-1,0],"up":[0,0.8,-0.6]' up
twice 'one that is not known' '"extra":1,"extra":1' extra
rig camera_matrix "$(matrix 3 3 "$camera" | sed 's/"rows"/"data":[1],"rows"/')" >d/rig.json
rig_case 'data of a matrix a second time' 'd/rig\.json: camera_matrix\.data: a second time'
twice 'a long name' "\"$(printf '%0200d' 0)\":1,\"$(printf '%0200d' 0)\":2" '0{60}'

field kind '"stereo"' 'kind: "stereo", expected "dots" or "range"'
field kind 1 'kind: .*expected "dots" or "range"'
for name in image_width image_height; do
    field $name 0 'image_width, image_height: .*expected'
    field $name -200 'image_width, image_height: .*expected'
    field $name 5000 'image_width, image_height: .*expected'
    field $name 480.5 "$name: 480\\.5, expected a whole number"
    field $name 1e999 "$name: inf, out of range"
    field $name 4294967616 "$name: .*out of range"
done

field camera_matrix "$(matrix 2 3 "$camera")" 'camera_matrix: rows is 2, expected 3'
field camera_matrix "$(matrix 3 4 "$camera")" 'camera_matrix: cols is 4, expected 3'
field camera_matrix "$(matrix '"3"' 3 "$camera")" 'camera_matrix: no rows, expected 3'
field camera_matrix "$(matrix 3 3 "$camera,1")" 'camera_matrix: 10 numbers in data, expected 9'
field camera_matrix "$(matrix 3 3 '')" 'camera_matrix: 0 numbers in data, expected 9'
field camera_matrix "$(matrix 3 3 "$camera" | sed 's/"dt":"d"/"dt":"u"/')" \
    'camera_matrix: dt is u, expected'
field camera_matrix "$(matrix 3 3 "$camera" | sed 's/"dt":"d",//')" 'camera_matrix: dt is missing'
field camera_matrix "$(matrix 3 3 "$camera" | sed 's/opencv/other/')" \
    'camera_matrix: type_id is other-matrix, expected'
field camera_matrix "$(matrix 3 3 "$camera" | sed 's/"data":.*]/"data":7/')" \
    'camera_matrix: data is no array'
field camera_matrix "$(matrix 3 3 '900,0,"x",0,900,200,0,0,1')" \
    'camera_matrix\[0\]\[2\]: a string, expected a number'
field camera_matrix "$(matrix 3 3 '1e999,0,300,0,900,200,0,0,1')" \
    'camera_matrix\[0\]\[0\]: inf, expected a finite number'
field camera_matrix "$(matrix 3 3 '0,0,300,0,900,200,0,0,1')" 'camera_matrix: focal lengths 0 and'
field camera_matrix "$(matrix 3 3 '900,0,300,0,-900,200,0,0,1')" 'camera_matrix: focal .* -900'
field camera_matrix "$(matrix 3 3 '20000,0,300,0,900,200,0,0,1')" 'camera_matrix: focal .* 20000'
field camera_matrix "$(matrix 3 3 '1e9,0,300,0,900,200,0,0,1')" 'camera_matrix\[0\]\[0\]: 1e\+09'
field camera_matrix "$(matrix 3 3 '900,2,300,0,900,200,0,0,1')" \
    'camera_matrix\[0\]\[1\]: 2, expected 0'
field camera_matrix "$(matrix 3 3 '900,0,300,0,900,200,0,0,2')" \
    'camera_matrix\[2\]\[2\]: 2, expected 1'
field camera_matrix "$(matrix 3 3 '900,0,9000,0,900,200,0,0,1')" \
    'camera_matrix: principal point \(9000, 200\)'
field camera_matrix "$(matrix 3 3 '100,0,300,0,100,200,0,0,1')" 'camera_matrix: '

field distortion_coefficients "$(matrix 1 4 0,0,0,0)" 'distortion_coefficients: cols is 4'
field distortion_coefficients "$(matrix 1 5 1e999,0,0,0,0)" \
    'distortion_coefficients\[0\]\[0\]: inf'
field distortion_coefficients "$(matrix 1 5 0,0,0,0,-500)" \
    'distortion_coefficients k3: -500, expected less than 128'
field distortion_coefficients "$(matrix 1 5 -30,0,0,0,0)" \
    'distortion_coefficients: -30 .*cannot be undone'

field projector_origin "$(matrix 1 3 12,0,0)" 'projector_origin: rows is 1, expected 3'
field projector_origin "$(matrix 3 1 0,0,0)" 'projector_origin: \(0, 0, 0\) mm, expected'
field projector_origin "$(matrix 3 1 5000,0,0)" 'projector_origin: \(5000, 0, 0\) mm, expected'
field projector_origin "$(matrix 3 1 12,1e6,0)" 'projector_origin y: 1e\+06, expected less than'
field projector_origin "$(matrix 3 1 12,0,-1e999)" 'projector_origin\[2\]\[0\]: -inf'

field dot_rays "$(matrix 360 3 "$(rays)")" 'dot_rays: rows is 360, expected 361'
field dot_rays "$(matrix 361 3 1,2,3)" 'dot_rays: 3 numbers in data, expected 1083'
field dot_rays "$(matrix 361 3 "$(rays 17 0 0 0.87)")" \
    'dot_rays\[17\]: \(0, 0, 0\.87\), length 0\.87, expected a unit vector'
field dot_rays "$(matrix 361 3 "$(rays 0 0 0 0)")" 'dot_rays\[0\]: .*length 0, expected'
field dot_rays "$(matrix 361 3 "$(rays 360 0 0 -1)")" 'dot_rays\[360\]: \(0, 0, -1\)'
field dot_rays "$(matrix 361 3 "$(rays 5 1 0 0)")" 'dot_rays\[5\]: \(1, 0, 0\)'
field dot_rays "$(matrix 361 3 "$(rays 5 7 0 0)")" 'dot_rays\[5\] x: 7, expected less than 2'
field dot_rays "$(matrix 361 3 "$(rays 5 0 1e999 0)")" 'dot_rays\[5\]\[1\]: inf'
# A pattern of half a degree: dots 0.5 mrad apart.
narrow=$(awk 'BEGIN {
    for (i = 0; i < 361; i++) {
        x = (i % 19 - 9) * 5e-4
        y = (int(i / 19) - 9) * 5e-4
        length_ = sqrt(x * x + y * y + 1)
        printf "%s%.12f,%.12f,%.12f", i ? "," : "", x / length_, y / length_, 1 / length_
    }
}')
field dot_rays "$(matrix 361 3 "$narrow")" 'dot_rays: dots closer than 2 mrad'

field near_mm 3000 'near_mm, far_mm: 3000 and 2600, expected'
field near_mm 2600 'near_mm, far_mm: 2600 and 2600, expected'
field near_mm 0 'near_mm, far_mm: 0 and 2600, expected'
field near_mm -400 'near_mm, far_mm: -400 and 2600, expected'
field near_mm 1e999 'near_mm: inf, out of range'
field far_mm 1e6 'near_mm, far_mm: 400 and 1000000, expected'
field far_mm -1e999 'far_mm: -inf, out of range'

rig extra '{"kind":["anything"]}' >d/rig.json
run --json d
check 'rig: an unknown field is ignored' 0 3 0 -
up() {
    rig extra '0' | sed "s/\"extra\":0/\"up\":$1/" >d/rig.json
}
up '[0,0,1]'
rig_case 'up along the axis' 'd/rig\.json: up: \(0, 0, 1\), length 1, expected a unit vector'
up '[0,-1.1,0]'
rig_case 'up that is no unit vector' 'd/rig\.json: up: \(0, -1\.1, 0\), length 1\.1, expected a unit vector'
up '[0,0,0]'
rig_case 'up of zeros' 'd/rig\.json: up: \(0, 0, 0\), expected a unit vector'
up '[0,-0.0,1e-12]'
rig_case 'up of next to nothing' 'd/rig\.json: up: \(0, -0, 1e-12\), expected a unit vector'
up '[0,-1]'
rig_case 'up of two numbers' 'd/rig\.json: up: 2 numbers, expected 3'
up '[0,"-1",0]'
rig_case 'up with a string' 'd/rig\.json: up\[0\]\[1\]: a string, expected a number'
up '[0,-1e999,0]'
rig_case 'up without end' 'd/rig\.json: up\[0\]\[1\]: -inf'
up '[0,-7,0]'
rig_case 'up beyond its format' 'd/rig\.json: up y: -7, expected less than 2'
up '"above"'
rig_case 'up in words' 'd/rig\.json: up: '
up '[0.6,-0.8,0]'
run --json d
check 'rig: rolled' 0 3 0 -
rig near_mm 400.7 >d/rig.json
run --json d
check 'rig: a fraction in near_mm is fine' 0 3 0 -
rig kind '"dots"' >d/rig.json
run --json d
check 'rig: kind "dots" is fine' 0 3 0 -
rig kind '"range"' >d/rig.json
run --json d
check 'rig: kind "range" with 8-bit frames' 1 0 3 'd/b\.pgm: maxval 255, expected above 255'
fresh

run --json --rig nowhere.json d
check 'rig: --rig names no file' 1 0 0 'nowhere\.json: No such file'
cp base/a.pgm other.json
run --json --rig other.json d
check 'rig: --rig names a frame' 1 0 0 'other\.json: line 1 column 1: not JSON'
echo broken >d/rig.json
run --json --rig base/rig.json d
check 'rig: --rig in place of a broken one' 0 3 0 -
rm d/rig.json
run --json --rig base/rig.json d
check 'rig: --rig in place of a missing one' 0 3 0 -
fresh

# --- range images --------------------------------------------------------------------------------

mkdir range
cat >range/rig.json <<'END'
{"kind":"range","image_width":64,"image_height":80,"near_mm":400,"far_mm":4000,
"camera_matrix":{"type_id":"opencv-matrix","rows":3,"cols":3,"dt":"d",
"data":[60,0,32,0,60,40,0,0,1]},
"distortion_coefficients":{"type_id":"opencv-matrix","rows":1,"cols":5,"dt":"f","data":[0,0,0,0,0]}}
END
{ printf 'P5\n64 80\n65535\n' && head -c 10240 /dev/zero; } >range/a.pgm
{ printf 'P5\n64 80\n65535\n' && head -c 10240 /dev/zero | tr '\000' '\003'; } >range/b.pgm
{ printf 'P5\n64 80\n65535\n' && head -c 10240 /dev/zero | tr '\000' '\377'; } >range/c.pgm
run --json range
check 'range: no depth, one depth, and beyond all range' 0 3 0 -

# Lists of points beside images.
cp -R range lists

# points NAME PATTERN FORMAT: lists/b.xyz is what printf makes of it.
points() {
    # shellcheck disable=SC2059 # the format is the list
    printf "$3" >lists/b.xyz
    run --json lists
    check "list: $1" 1 4 1 "$2"
}

# good_points NAME FORMAT: the same, and nothing is wrong with it.
good_points() {
    # shellcheck disable=SC2059 # the format is the list
    printf "$2" >lists/b.xyz
    run --json lists
    check "list: $1" 0 5 0 -
}

printf '0 0 1000\n' >lists/aa.xyz
good_points 'one point' '0 0 1000'
good_points 'no points' ''
good_points 'comments, empty lines, blanks and carriage returns' \
    '# made by hand\n\n \t# more\r\n  1.5\t-2e1 +1000.25 \r\n\r\n0 0 900 '
good_points 'a byte-order mark before a point' '\357\273\2770 0 900\n'
good_points 'a byte-order mark before a comment' '\357\273\277# by a spreadsheet\n0 0 900\n'
reason='the order is not that of the names'
order=$(sed 's/^{"file":"\([^"]*\)".*/\1/' out | tr '\n' ' ')
[ "$order" != 'a.pgm aa.xyz b.pgm b.xyz c.pgm ' ] || reason=
result 'list: mixed with images in the order of names' "$reason"
points 'two numbers' 'lists/b\.xyz: line 2: it ends early, expected three numbers' '0 0 900\n1 2\n'
points 'two numbers at the end' 'lists/b\.xyz: line 1: it ends early' '1 2'
points 'four numbers' 'lists/b\.xyz: line 1: more than three numbers' '1 2 900 4\n'
points 'a word' 'lists/b\.xyz: line 3: high, expected a number' '#\n\n1 2 high\n'
points 'commas' 'lists/b\.xyz: line 1: 1,2,900, expected a number' '1,2,900\n'
points 'digits and more' 'lists/b\.xyz: line 1: 900mm, expected a number' '1 2 900mm\n'
points 'a comment behind a point' 'lists/b\.xyz: line 1: more than three numbers' '1 2 900 # head\n'
points 'a hexadecimal number' 'lists/b\.xyz: line 1: 0x384, expected a number' '1 2 0x384\n'
points 'a hexadecimal number with a sign' 'lists/b\.xyz: line 2: -0X1p3, expected a number' '0 0 900\n1 -0X1p3 900\n'
points 'not a number' 'lists/b\.xyz: line 1: -?nan mm, expected within' 'nan nan nan\n'
points 'infinite' 'lists/b\.xyz: line 1: inf mm, expected within' '1 2 inf\n'
points 'beyond all bounds' 'lists/b\.xyz: line 1: 8\.00001e\+06 mm, expected within' '1 2 8000010\n'
points 'a byte-order mark in the middle' 'lists/b\.xyz: line 2: .*, expected a number' '0 0 900\n\357\273\2770 0 900\n'
points 'a zero byte' 'lists/b\.xyz: offset 8: a zero byte' '1 2 900\n\000'
points 'metres' 'lists/b\.xyz: none of 2 points can be seen: 2 are nearer than 400 mm' \
    '0 0 0.9\n0 0.1 1.1\n'
points 'far and beside' 'lists/b\.xyz: none of 2 .* 1 farther than 4000 mm, 1 beside the image' \
    '0 0 9000\n5000 0 1000\n'
points 'a very long word' 'lists/b\.xyz: line 1: x{40}, expected a number' \
    "$(printf '%0300d' 0 | tr 0 x)"
rm lists/b.xyz && mkdir lists/b.xyz
run --json lists
check 'list: a directory' 1 4 1 'lists/b\.xyz: a directory, expected a file'
rm -r lists/b.xyz lists/a*.* lists/b.pgm lists/c.pgm
printf '0 0 1000\n' >lists/only.xyz
run --json lists
check 'list: nothing else' 0 1 0 -
run --json --rig lists/rig.json lists
check 'list: with the rig from elsewhere' 0 1 0 -
printf '0 0 1000\n' >d/b.xyz
run --json d
check 'list: no frame for a dot rig' 0 3 0 'd: 1 file is not read, .* need a rig of "kind": "range"'
fresh
{ printf 'P5\n64 80\n255\n' && head -c 5120 /dev/zero; } >range/b.pgm
run --json range
check 'range: an 8-bit frame' 1 2 1 'range/b\.pgm: maxval 255, expected above 255'

# --- frames and rig that do not fit --------------------------------------------------------------

# hint NAME PATTERN: of the last run of one directory: all is well, but one line says what is wrong.
hint() {
    count=$(wc -l <out)
    check "hint: $1" 0 "$count" 0 "$2"
    lines=$(wc -l <err)
    [ "$lines" -eq 1 ] && reason= || reason="$lines lines on standard error, expected 1"
    result "hint: $1: one line" "$reason"
}

# The camera's matrix with its principal point elsewhere, by px.
moved() { echo "$camera" | awk -F , -v OFS=, -v x="$1" -v y="$2" '{ $3 += x; $6 += y; print }'; }
rig camera_matrix "$(matrix 3 3 "$(moved 0 40)")" >d/rig.json
run --json d
hint 'moved beyond mending' 'd: hardly a dot has a good label in 3 of 3 frames: its rig\.json does not fit .*calibrate again'
run --json --paper d
hint 'moved, with --paper' 'd: hardly a dot .* try without --paper'
mv d/rig.json other.json
cp base/rig.json d
run --json --rig other.json d
hint 'the file of --rig' 'd: hardly a dot .* in 3 of 3 frames: other\.json does not fit'
run --json d
check 'hint: none where the rig fits' 0 3 0 -
rig projector_origin "$(matrix 3 1 0,125,0)" >d/rig.json
run --json d
hint 'another rig: the laser above the camera' 'd: hardly a dot has a good label'
rig projector_origin "$(matrix 3 1 125,0,0.2)" >d/rig.json
run --json d
hint 'another rig: the laser farther away, labels by chance' 'd: hardly a dot has a good label'
rig near_mm 2500 >d/rig.json
run --json d # all that is there is nearer
hint 'nothing in the working range' 'd: hardly a dot .* nearer than 2500 or farther than 2600 mm'
sed 's/"near_mm":[^,]*/"near_mm":300/; s/"far_mm":[^,}]*/"far_mm":500/' d/rig.json >far.json
run --json --rig far.json d # all that is there is farther
hint 'a room beyond the working range' 'd: hardly a dot .* of 3 frames, but dots lie on the lines of far\.json: .* farther than 500 mm, or the projector is nearer to the camera or farther from it'
rm far.json
{ printf 'P5\n%d %d\n255\n' "$width" "$height" && head -c $((width * height)) /dev/zero; } >d/black.pgm
cp d/black.pgm d/a.pgm && cp d/black.pgm d/b.pgm && mv d/black.pgm d/c.pgm
run --json d
check 'hint: none without dots' 0 3 0 -
fresh

# A wall in a depth image, at 1 to 2 m; every eighth pixel is not measured.
# depths NAME MULTIPLIER DIVISOR SWAPPED: range/NAME.pgm
depths() {
    { printf 'P5\n64 80\n65535\n' && awk -v times="$2" -v over="$3" -v swapped="$4" 'BEGIN {
        for (i = 0; i < 5120; i++) {
            mm = i % 8 == 0 ? 0 : 1000 + i % 64 * 10 + int(i / 64) * 5
            value = int(mm * times / over)
            high = int(value / 256)
            low = value % 256
            if (swapped) printf "\\%03o\\%03o", low, high
            else printf "\\%03o\\%03o", high, low
        }
    }' | xargs -0 printf; } >"range/$1.pgm"
}
rm range/*.pgm
depths a 1 1 0
run --json range
check 'hint: none for depth in mm' 0 1 0 -
depths a 1 1 1
run --json range
hint 'bytes swapped' 'range: [0-9]+ % of its depths lie within 400 \.\. 4000 mm, but 100 % would if .*bytes swapped .*: write the frames again'
depths a 1 10 0
run --json range
hint 'cm' 'range: 0 % of its depths .* but 100 % would if they were cm: enter "depth_scale": 10 in its rig\.json'
depths a 10 1 0
run --json range
hint 'a tenth of a mm' 'range: 0 % of its depths .* but 100 % would if they were 0\.1 mm .*: enter "depth_scale": 0\.1 in'
depths a 1 1000 0
run --json range
hint 'metres' 'range: 0 % of its depths .* but 100 % would if they were metres: enter "depth_scale": 1000 in'
sed 's/"near_mm":400,"far_mm":4000/"near_mm":3000,"far_mm":4000/' range/rig.json >other.json
depths a 1 1 0
run --json --rig other.json range
hint 'nothing in the working range of depth' \
    'range: 0 % of its depths lie within 3000 \.\. 4000 mm, the median is 1[0-9]* mm: .* far_mm in other\.json'
{ printf 'P5\n64 80\n65535\n' && head -c 10240 /dev/zero; } >range/a.pgm
run --json --rig other.json range
check 'hint: none where nothing is measured' 0 1 0 -

# --- frames.jsonl --------------------------------------------------------------------------------

# list NAME STATUS GOOD BAD PATTERN LINES: frames.jsonl is what printf makes of the lines.
list() {
    # shellcheck disable=SC2059
    printf "$6" >d/frames.jsonl
    run --json d
    check "frames.jsonl: $1" "$2" "$3" "$4" "$5"
    fresh
}

a='{"file":"a.pgm","time_us":0,"laser":true}\n'
b='{"file":"b.pgm","time_us":40000,"laser":true}\n'
c='{"file":"c.pgm","time_us":80000,"laser":true}\n'
list 'good, in another order' 0 3 0 - "$c$a\\n$b"
list 'laser off makes no record' 0 2 0 - "$a"'{"file":"b.pgm","time_us":5,"laser":false}\n'"$c"
list 'laser left out' 0 3 0 - "$a"'{"file":"b.pgm","time_us":5}\n'"$c"
list 'a broken line' 1 2 1 'd/frames\.jsonl: line 2: not a JSON object: \{"file":' \
    "$a"'{"file":"b.pgm","time_us"\n'"$c"
list 'a line that is no object' 1 2 1 'd/frames\.jsonl: line 2: not a JSON object' "$a"'[]\n'"$c"
list 'a zero byte' 1 2 1 'd/frames\.jsonl: line 2: a zero byte' "$a"'{"file":\000}\n'"$c"
list 'a frame that is not listed' 1 2 1 'd/b\.pgm: not listed in frames\.jsonl' "$a$c"
list 'a listed frame that is not there' 1 3 0 \
    'd/frames\.jsonl: 1 of its frames are not in this directory, the first in line 4' \
    "$a$b$c"'{"file":"d.pgm","time_us":99999,"laser":true}\n'
list 'a frame listed twice' 1 3 0 'd/frames\.jsonl: line 3: b\.pgm was listed before' "$a$b$b$c"
list 'no file' 1 2 1 'd/frames\.jsonl: line 2: no file' "$a"'{"time_us":5}\n'"$c"
list 'a path for a file' 1 3 0 'd/frames\.jsonl: line 4: file is "../d/a\.pgm", expected' \
    "$a$b$c"'{"file":"../d/a.pgm","time_us":5}\n'
list 'not the name of a frame' 1 3 0 'd/frames\.jsonl: line 4: file is "rig\.json", expected' \
    "$a$b$c"'{"file":"rig.json","time_us":5}\n'
list 'no time' 1 2 1 'd/b\.pgm: frames\.jsonl line 2: no time_us' "$a"'{"file":"b.pgm"}\n'"$c"
list 'a string for a time' 1 2 1 'd/b\.pgm: frames\.jsonl line 2: time_us: expected a number' \
    "$a"'{"file":"b.pgm","time_us":"5"}\n'"$c"
list 'a fraction for a time' 1 2 1 'd/b\.pgm: frames\.jsonl line 2: time_us is 5\.5, expected' \
    "$a"'{"file":"b.pgm","time_us":5.5}\n'"$c"
list 'an endless time' 1 2 1 'd/b\.pgm: frames\.jsonl line 2: time_us is inf, expected' \
    "$a"'{"file":"b.pgm","time_us":1e999}\n'"$c"
list 'a word for laser' 1 2 1 'd/b\.pgm: frames\.jsonl line 2: laser: expected true or false' \
    "$a"'{"file":"b.pgm","time_us":5,"laser":"on"}\n'"$c"
list 'a field twice' 1 2 1 'd/frames\.jsonl: line 2: time_us: a second time' \
    "$a"'{"file":"b.pgm","time_us":40000,"time_us":50000}\n'"$c"
list 'time goes back' 1 2 1 'd/c\.pgm: frames\.jsonl: time_us 39999 is before 40000' \
    "$a$b"'{"file":"c.pgm","time_us":39999}\n'
list 'empty' 1 0 3 'd/b\.pgm: not listed in frames\.jsonl' ''
list 'garbage' 1 0 3 'd/frames\.jsonl: line 1: not a JSON object' '\377\376\001\002\n\n{{{{'
mkdir d/frames.jsonl
run --json d
check 'frames.jsonl: a directory' 1 3 0 'd/frames\.jsonl: a directory, expected a file'
fresh
# shellcheck disable=SC2059 # $a is written as a format: \n
printf "$a"'{"file":"b.pgm","time_us":5,"laser":false}\n'"$c" >d/frames.jsonl
: >d/b.pgm
run --json d
check 'frames.jsonl: a lost frame with the laser off' 1 2 0 'd/b\.pgm: .*empty'
fresh
# shellcheck disable=SC2059 # $a is written as a format: \n
printf "$a"'{"file":"b.pgm","time_us":5,"laser":false}\n'"$c" >d/frames.jsonl
printf 'P5\n2 2\n255\n1234' >d/b.pgm
run --json d
check 'frames.jsonl: a frame with the laser off of another size' 1 2 0 'd/b\.pgm: 2x2 px, expected'
fresh

# A frame without laser takes from the next what they have in common, when it is fresh: here all of it.
ambient() {
    cp d/c.pgm d/b.pgm
    # shellcheck disable=SC2059 # $a is written as a format: \n
    printf "$a"'{"file":"b.pgm","time_us":5,"laser":false}\n{"file":"c.pgm","time_us":%d}\n' "$1" >d/frames.jsonl
    # shellcheck disable=SC2086 # no or two words
    run --json $3 d
    dots=$(sed -n 's/^{"file":"c.pgm".*"dots":\([0-9]*\),.*/\1/p' out)
    test "$dots" "$2" 30 && reason= || reason="$dots dots"
    result "$4" "$reason"
    fresh
}
ambient 200005 -lt '' 'the same frame without laser 200 ms before: no dots'
ambient 200006 -gt '' 'the same frame without laser 200.001 ms before: all dots'
ambient 200005 -gt '--without ambient' 'the same, left out: all dots'

# --- truth.jsonl ---------------------------------------------------------------------------------

# truth NAME PATTERN LINE: truth of b.pgm is this line; all frames are processed all the same.
truth() {
    printf '{"file":"a.pgm","head":null}\n%s\n{"file":"c.pgm","head":null}\n' "$3" >d/truth.jsonl
    run --json d
    check "truth.jsonl: $1" 1 3 0 "d/truth\\.jsonl: $2"
    fresh
}

printf '{"file":"%s.pgm","head":{"centre_mm":[1,-2.5,800]},"dots":[[0,1.5,2,900]]}\n' a b c \
    >d/truth.jsonl
run --json d
check 'truth.jsonl: good' 0 3 0 -
printf '{"file":"%s.pgm","heads":[{"centre_mm":[1,2,3]}]}\n' a b c >d/truth.jsonl
run --json d
check 'truth.jsonl: several heads are fine' 0 3 0 -
fresh
truth 'a frame without truth' 'no line for b\.pgm' ''
truth 'two lines for a frame' 'line 2: a\.pgm has truth in line 1 already' \
    '{"file":"a.pgm","head":null}'
truth 'a broken line' 'line 2: not a JSON object' '{"file":"b.pgm","head":'
truth 'a field twice' 'line 2: head: a second time' '{"file":"b.pgm","head":null,"head":null}'
truth 'a field of the head twice' 'line 2: head\.centre_mm: a second time' \
    '{"file":"b.pgm","head":{"centre_mm":[1,2,800],"centre_mm":[1,2,900]}}'
truth 'no file' 'line 2: no file' '{"head":null}'
truth 'a number for a file' 'line 2: no file' '{"file":7,"head":null}'
truth 'no head' 'line 2: no head' '{"file":"b.pgm"}'
truth 'a string for a head' 'line 2: head: expected an object or null' '{"file":"b.pgm","head":"yes"}'
truth 'a head without centre' 'line 2: head\.centre_mm: expected 3' '{"file":"b.pgm","head":{}}'
truth 'a centre of 2 numbers' 'line 2: head\.centre_mm: expected 3' \
    '{"file":"b.pgm","head":{"centre_mm":[1,2]}}'
truth 'a centre at infinity' 'line 2: head\.centre_mm: expected 3 numbers within' \
    '{"file":"b.pgm","head":{"centre_mm":[1,2,1e999]}}'
truth 'a negative axis' 'line 2: head\.semi_axes_mm: expected' \
    '{"file":"b.pgm","head":{"centre_mm":[1,2,3],"semi_axes_mm":[70,-1,90]}}'
truth 'dots that are no array' 'line 2: dots: expected' '{"file":"b.pgm","head":null,"dots":5}'
truth 'a dot of index 361' 'line 2: dots\[1\]: expected \[index below 361' \
    '{"file":"b.pgm","head":null,"dots":[[0,1,2,900],[361,1,2,900]]}'
truth 'a dot of 3 numbers' 'line 2: dots\[0\]: expected' \
    '{"file":"b.pgm","head":null,"dots":[[0,1,2]]}'
truth 'a dot twice' 'line 2: dots\[1\]: index 4 again, expected each index once' \
    '{"file":"b.pgm","head":null,"dots":[[4,1,2,900],[4,1,2,900]]}'
mkdir d/truth.jsonl
run --json d
check 'truth.jsonl: a directory' 1 3 0 'd/truth\.jsonl: a directory, expected a file'
fresh

# --- directories ---------------------------------------------------------------------------------

run --json nowhere
check 'directory: not there' 1 0 0 'nowhere: No such file'
run --json nowhere d
check 'directory: not there, another is good' 1 3 0 'nowhere: No such file'
run --json d/a.pgm
check 'directory: a file' 1 0 0 'd/a\.pgm: Not a directory'
mkdir empty
run --json empty
check 'directory: empty' 1 0 0 'empty: no rig\.json here and in no subdirectory'
rm d/*.pgm
run --json d
check 'directory: no frames' 1 0 0 'd: no frames \(\*\.pgm, \*\.png\)'
fresh
mkdir many many/notes && cp -R base many/two && cp -R base many/one
run --json many
check 'directory: subdirectories in order' 0 6 0 -
reason=
head -n 1 out | grep -q '"dir":"many/one"' || reason='many/one does not come first'
result 'directory: records say which' "$reason"
echo broken >many/one/rig.json
: >many/two/a.pgm
run --json many
check 'directory: a broken rig beside a good one' 1 2 1 'many/one/rig\.json: .*not JSON'
rm -rf many/one/rig.json
run --json many
check 'directory: one without a rig is passed over' 1 2 1 'many/two/a\.pgm: '
mkdir many/lost+found && echo broken >many/lost+found/rig.json
run --json many
check 'directory: that of a file system is passed over' 1 2 1 'many/two/a\.pgm: '
rm -r many/lost+found
if [ "$(id -u)" -ne 0 ]; then # root may read everything
    cp -R base many/shut && chmod 000 many/shut
    run --json many
    check 'directory: one that may not be read' 1 2 1 'many/shut/rig\.json: Permission denied'
    run --json many/shut
    check 'directory: it may not be read' 1 0 0 'many/shut/rig\.json: Permission denied'
    chmod 700 many/shut && rm -r many/shut
fi

# --- command line --------------------------------------------------------------------------------

run
check 'usage: nothing' 2 0 0 'host_sim: no frames directory'
run --json
check 'usage: no directory' 2 0 0 'host_sim: no frames directory'
run --nonsense d
check 'usage: unknown option' 2 0 0 'host_sim: unknown option.*--nonsense'
run -x d
check 'usage: unknown letter' 2 0 0 'host_sim: unknown option.*-x'
run --json=1 d
check 'usage: argument that is not wanted' 2 0 0 'host_sim: .*--json=1'
run --rig
check 'usage: --rig without a file' 2 0 0 'host_sim: missing argument of --rig'
run --trace '' d
check 'usage: empty --trace' 2 0 0 'host_sim: empty argument of --trace'
run --json --rig= d
check 'usage: empty --rig=' 2 0 0 'host_sim: empty argument of --rig;'
run --json --without
check 'usage: --without without a part' 2 0 0 'host_sim: missing argument of --without'
run --json --without '' d
check 'usage: empty --without' 2 0 0 'host_sim: empty argument of --without'
# the list, and of it what is no part
while IFS=: read -r list unknown; do
    run --json --without "$list" d
    check "usage: --without $list" 2 0 0 "host_sim: --without $list: no part '$unknown';"
done <<'END'
tracking:tracking
scan,tracking,fit:tracking
scan,:
,scan:
scan,,fit:
sca:sca
scans:scans
END
run --json --without scan --without fit,tracks --without nests,expected,move,windows,skips,missing,ambient d
check 'usage: --without all parts' 0 3 0 -
run --help
reason='no help'
[ "$(cat status)" -ne 0 ] || ! grep -q -- '--trace OUT' out || reason=
result 'usage: --help' "$reason"
run --version
reason='no version'
[ "$(cat status)" -ne 0 ] || ! grep -Eq '^host_sim [0-9]+\.[0-9]+' out || reason=
result 'usage: --version' "$reason"

# --- output --------------------------------------------------------------------------------------

# unwritable NAME ARGUMENT...: standard output is full.
unwritable() {
    name=$1
    shift
    : >out
    timeout 600 "$host_sim" "$@" >/dev/full 2>err
    echo $? >status
    check "output: full, $name" 1 0 0 'standard output'
}
unwritable 'records' --json d
unwritable 'table' d
unwritable 'help' --help

: >out
timeout 600 "$host_sim" --json --trace trace d >&- 2>err
echo $? >status
check 'output: closed' 1 0 0 'standard output'
timeout 600 "$host_sim" --json d >out 2>&-
echo $? >status
: >err
check 'output: standard error is closed' 0 3 0 -
: >d/b.pgm
timeout 600 "$host_sim" --json --trace trace d >out 2>&-
echo $? >status
check 'output: standard error is closed and something to tell' 1 2 1 -
rm -rf trace

run d
reason='the table does not go on behind an error'
! grep -Eq '^c\.pgm ' out || ! grep -Eq '^b\.pgm +error: ' out || reason=
result 'output: table with a lost frame' "$reason"
fresh

run --json --trace trace d
check 'trace: good' 0 3 0 -
reason='not all frames are there'
[ ! -s trace/d/a.json ] || [ ! -s trace/d/b.json ] || [ ! -s trace/d/c.json ] || reason=
result 'trace: a file per frame' "$reason"
rm trace/d/b.json && ln -s /dev/full trace/d/b.json
run --json --trace trace d
check 'trace: full' 1 3 0 'd/b\.pgm: trace trace/d/b\.json: No space left'
run --json --trace d/a.pgm d
check 'trace: OUT is a file' 1 0 0 'd: trace d/a\.pgm/d: Not a directory'
rm -rf trace many/two/a.pgm && cp base/a.pgm many/two/a.pgm && mkdir elsewhere &&
    cp -R base elsewhere/two
run --json --trace trace/deep/er many elsewhere
check 'trace: two directories of one name' 0 6 0 -
reason='they are not kept apart'
[ ! -s trace/deep/er/two/a.json ] || [ ! -s trace/deep/er/two-2/a.json ] || reason=
result 'trace: two directories of one name are kept apart' "$reason"

fresh
cp d/b.pgm d/a.PGM && cp d/c.pgm d/a.pgm.pgm
rm -rf trace
run --json --trace trace d
check 'trace: frames that differ in their suffix' 0 5 0 -
reason=
[ "$(cd trace/d && echo *)" = 'a.PGM.json a.pgm.json a.pgm.pgm.json b.json c.json' ] ||
    reason="$(cd trace/d && echo *)"
for name in a.PGM a.pgm a.pgm.pgm; do
    grep -q "^{\"file\":\"$name\"," "trace/d/$name.json" || reason="$reason: $name is not in its file"
done
result 'trace: frames that differ in their suffix have a file each' "$reason"
rm -r trace

fresh
cp d/a.pgm d/rig.pgm
cp d/rig.json before
mkdir links && ln -s ../d links/d
for out in . ./ d/.. links; do
    run --json --trace "$out" d
    check "trace: $out, so that they would lie among the frames" 2 0 0 \
        'd: a frames directory of this run, expected another OUT of --trace'
    reason='it was overwritten'
    ! cmp -s before d/rig.json || reason=
    result "trace: $out: rig.json is as before" "$reason"
done
fresh
mkdir p && cp -R base p/d
run --json --trace . p/d d
check 'trace: among the frames of another directory' 2 0 0 '\./d: a frames directory of this run'
rm -rf p links

fresh
for name in a.pgm rig.json; do
    cp "d/$name" before
    run --json --report "d/../d/$name" d
    check "report: over $name" 1 0 0 "$name: a file that this run reads"
    reason='it was overwritten'
    ! cmp -s before "d/$name" || reason=
    result "report: $name is as before" "$reason"
done
ln -s ../base/a.pgm d/link.pgm
run --json --report base/a.pgm d
check 'report: over what a frame is a link to' 1 0 0 'base/a\.pgm: a file that this run reads'
rm d/link.pgm
run --json --rig base/rig.json --report base/rig.json d
check 'report: over --rig' 1 0 0 'base/rig\.json: a file that this run reads'
fresh

# A file that is none of another run: a few of its lines say so, whatever its length.
yes '{"file":"x.pgm"}' | head -n 1000 >other.jsonl
run --json --report page.html --against other.jsonl d
if ! grep -q 'has no report page' err; then
    check 'report: against no records' 1 3 0 'other\.jsonl: 3 lines that are no records: it is read no further'
    lines=$(wc -l <err)
    [ "$lines" -eq 4 ] && reason= || reason="$lines lines on standard error, expected 4"
    result 'report: against no records: few lines' "$reason"
fi

echo "1..$number"
echo "# $((number - failed)) passed, $failed failed"
[ "$failed" -eq 0 ]
