// Runs the functions of the shader of heat, which are put into the class below, for each line of
// numbers: a place, its frame's place and its cell (10), or two heats, blend, erosion, row and size of the ramp (7).

using System;
using System.Globalization;
using System.Linq;

struct float2
{
    public float x, y;
    public static float2 operator +(float2 a, float2 b) { return new float2 { x = a.x + b.x, y = a.y + b.y }; }
    public static float2 operator -(float2 a, float2 b) { return new float2 { x = a.x - b.x, y = a.y - b.y }; }
    public static float2 operator *(float2 a, float2 b) { return new float2 { x = a.x * b.x, y = a.y * b.y }; }
    public static float2 operator /(float2 a, float2 b) { return new float2 { x = a.x / b.x, y = a.y / b.y }; }
}

struct float3 { public float x, y, z; }

struct float4
{
    public float2 xy, zw;
    public float4(float[] n, int at)
    {
        xy = new float2 { x = n[at], y = n[at + 1] };
        zw = new float2 { x = n[at + 2], y = n[at + 3] };
    }
}

static class Shader
{
    static float max(double a, double b) { return (float)Math.Max(a, b); }
    static float2 step(double edge, float2 x) { return float2(x.x >= edge ? 1 : 0, x.y >= edge ? 1 : 0); }
    static float2 step(float2 edge, double x) { return float2(x >= edge.x ? 1 : 0, x >= edge.y ? 1 : 0); }
    static float2 float2(double x, double y) { return new float2 { x = (float)x, y = (float)y }; }
    static float3 float3(float2 xy, float z) { return new float3 { x = xy.x, y = xy.y, z = z }; }

    FUNCTIONS

    static void Main()
    {
        var point = CultureInfo.InvariantCulture;
        string line;
        while ((line = Console.ReadLine()) != null)
        {
            float[] n = line.Split(' ').Select(each => float.Parse(each, point)).ToArray();
            if (n.Length == 10)
            {
                float3 on = OnPage(float2(n[0], n[1]), new float4(n, 2), new float4(n, 6));
                Console.WriteLine(string.Format(point, "{0:R} {1:R} {2:R}", on.x, on.y, on.z));
                continue;
            }
            float2 at = OnRamp(Faded(n[0], n[1], n[2]), n[3], n[4], float2(n[5], n[6]));
            Console.WriteLine(string.Format(point, "{0:R} {1:R}", at.x, at.y));
        }
    }
}
