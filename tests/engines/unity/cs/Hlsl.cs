// What functions of a shader use of HLSL, so that C# runs their text: they are put into the class
// below, called by Main for each line of numbers: x, y, z, w of a shape; r, g, b of light.

using System;
using System.Globalization;

struct float3
{
    public float x, y, z;
    public static float3 operator *(float3 a, float b) { return new float3 { x = a.x * b, y = a.y * b, z = a.z * b }; }
    public static float3 operator +(float a, float3 b) { return new float3 { x = a + b.x, y = a + b.y, z = a + b.z }; }
    public static float3 operator /(float3 a, float3 b) { return new float3 { x = a.x / b.x, y = a.y / b.y, z = a.z / b.z }; }
}

struct float4
{
    public float x, y, z, w;
}

class Shader
{
    static float abs(float value) { return Math.Abs(value); }
    static float clamp(float value, float low, float high) { return Math.Min(Math.Max(value, low), high); }
    static float saturate(float value) { return clamp(value, 0, 1); }
    static float lerp(float a, float b, float part) { return a + (b - a) * part; }

    FUNCTIONS

    static void Main()
    {
        var shader = new Shader();
        string line;
        while ((line = Console.ReadLine()) != null)
        {
            float[] n = Array.ConvertAll(line.Split(' '), text => float.Parse(text, CultureInfo.InvariantCulture));
            var shape = new float4 { x = n[0], y = n[1], z = n[2], w = n[3] };
            float3 shown = shader.exposed(new float3 { x = n[4], y = n[5], z = n[6] } * shader.weight(shape));
            Console.WriteLine(string.Format(CultureInfo.InvariantCulture, "{0:R} {1:R} {2:R}", shown.x, shown.y, shown.z));
        }
    }
}
